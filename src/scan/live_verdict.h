// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/live_features.h"

#include <bundle_icp/registration/bundle_icp_result.h>
#include <bundle_icp/registration/frame_registration.h>
#include <bundle_icp/scan/scan_session.h>

namespace bundle_icp {

/** Sets the deviations of a pose. \param information on motions on the left of the pose */
void
setDeviations(const Matrix6d& information, LivePose& pose);

/** Status, reason and deviations of a pose that ICP has found, which `pose` holds.
 *  \param correction from the start of ICP
 *  \param matched features that gave the start, null = motion did
 *  \param dense information of depth on motions on the left of the pose */
void
judge(const BundleICPResult& icp, const Pose& correction, const VisualMatches* matched,
      const Matrix6d& dense, const FrameRegistrationOptions& options, LivePose& pose);

/** Whether a pose is near enough to where it was before depth or images corrected it. */
bool
isSmallCorrection(const Pose& correction);

} // namespace bundle_icp
