// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "mapping/joint_evidence.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <array>
#include <cstdint>
#include <vector>

namespace bundle_icp {

/** Shape of a part in its world: what two parts may have in common where images match nothing. */
struct PartShape {
  /** A point where the surface bends, with its descriptor. */
  struct Keypoint {
    Eigen::Vector3f point, normal;
    std::array<float, 33> descriptor{}; ///< fast point feature histogram (Rusu 2009), L2 norm 1
  };
  /** A large plane: normal . x = offset, seen from the side of the normal. */
  struct Plane {
    Eigen::Vector3d normal;
    double offset = 0;    ///< [m]
    std::size_t size = 0; ///< points
  };

  double spacing = 0; ///< of the cloud's points [m]
  pcl::PointCloud<pcl::PointNormal> cloud;
  std::vector<Keypoint> keypoints;
  std::vector<Plane> planes; ///< largest first
};

/** Shape from the depth of a part's frames. Surfaces bend or not at a scale that follows from how
 *  far they are. */
PartShape
partShape(const SparseModel& model, const DepthViewProvider& depth_views, const Part& part);

/** Motions first_from_second that bring similar keypoints, or planes at the same angles, onto each
 *  other, and with them most of the second cloud onto the first: best first, no two alike.
 *  \param max_motions as many at most */
std::vector<Pose>
motionsByShape(const PartShape& first, const PartShape& second, std::size_t max_motions);

} // namespace bundle_icp
