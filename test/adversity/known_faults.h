// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <map>
#include <string>

namespace adversity {

/** Inputs with a silent fault that is known, and why it stays. The suite fails as well when one of
 *  them is a fault no longer. */
inline const std::map<std::string, std::string>&
knownFaults()
{
  static const std::map<std::string, std::string> faults = {};
  return faults;
}

} // namespace adversity
