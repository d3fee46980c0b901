// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <vector>

namespace bundle_icp {

/** A camera at the mean of the cameras that looks where they looked on average, with
 *  the average top up; from above at an angle when they looked all around. \throws
 *  pcl::BadArgumentException for no poses or one that is not finite. */
Pose
meanView(const std::vector<Pose>& world_from_cameras);

} // namespace bundle_icp
