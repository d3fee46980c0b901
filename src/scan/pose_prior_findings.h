// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/finding.h>
#include <bundle_icp/mapping/pose_prior_report.h>

#include <vector>

namespace bundle_icp {

/** What prior poses were worth; empty when there were none. */
std::vector<Finding>
posePriorFindings(const PosePriorReport& prior);

} // namespace bundle_icp
