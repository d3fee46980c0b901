// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/registration/bundle_icp_result.h>

#include "common/concatenate.h"

namespace bundle_icp {

const char*
toString(BundleICPStatus status)
{
  switch (status) {
  case BundleICPStatus::NOT_RUN:
    return "NOT_RUN";
  case BundleICPStatus::CONVERGED:
    return "CONVERGED";
  case BundleICPStatus::MAX_ITERATIONS:
    return "MAX_ITERATIONS";
  case BundleICPStatus::TOO_FEW_CORRESPONDENCES:
    return "TOO_FEW_CORRESPONDENCES";
  case BundleICPStatus::NO_OVERLAP:
    return "NO_OVERLAP";
  case BundleICPStatus::REFINEMENT_REJECTED:
    return "REFINEMENT_REJECTED";
  case BundleICPStatus::INVALID_INPUT:
    return "INVALID_INPUT";
  }
  return "";
}

std::string
BundleICPResult::summary() const
{
  return concatenate(toString(status), ": ", inliers, " inliers, overlap ", overlap, ", distance ",
                     rmse, projective ? " m" : "", ", ", iterations, " iterations");
}

} // namespace bundle_icp
