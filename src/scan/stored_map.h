// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/scan_database.h"

#include <bundle_icp/mapping/incremental_mapper.h>

#include <string>

namespace bundle_icp {

/** The state of a mapper in a scan database. */
class StoredMap : public MapStore {
public:
  /** \param fingerprint hash of all that the map depends on */
  StoredMap(ScanDatabase& database, std::uint64_t fingerprint)
  : database_(database), fingerprint_(fingerprint)
  {
  }

  std::optional<std::string>
  load() override
  {
    std::optional<std::string> state = database_.map(fingerprint_);
    was_known_ = state.has_value();
    return state;
  }

  void
  save(const std::string& state) override
  {
    database_.setMap(fingerprint_, state);
  }

  /** Whether load() gave a state. */
  bool
  wasKnown() const
  {
    return was_known_;
  }

private:
  ScanDatabase& database_;
  const std::uint64_t fingerprint_;
  bool was_known_ = false;
};

} // namespace bundle_icp
