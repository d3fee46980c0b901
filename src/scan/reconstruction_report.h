// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/reconstruction.h>

#include <nlohmann/json_fwd.hpp>

namespace bundle_icp {

/** The content of `report.json`. */
nlohmann::ordered_json
makeReport(const RGBDDataset& dataset, const ReconstructionOptions& options,
           const ReconstructionResult& result);

} // namespace bundle_icp
