// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "registration/dense_matches.h"

namespace bundle_icp {

/** Associates by nearest neighbours: for clouds without a grid, in any unit of length.
 */
class NearestMatcher {
public:
  explicit NearestMatcher(const AlignmentProblem& problem);

  /** Fills matches with sigma = 1. Point-to-plane where the target is planar, otherwise
   *  three entries along the axes for each pair: point-to-point. */
  void
  match(const SourcePoints& source, const Pose& pose, const Eigen::Vector3d& center,
        float max_distance, Matches& matches);

  /** Near is within twice the distance of the target point from its fourth neighbour, a bound
   *  without a unit of length. A source point within three times that bound counts three times
   *  against the pose: where surfaces only cross, two such points come with each near point. */
  Meeting
  meeting(const SourcePoints& source, const Matches& matches, const Eigen::Vector3d& center) const;

private:
  void
  findNearest(const SourcePoints& source, const Pose& pose, const Eigen::Vector3d& center,
              float max_distance, Matches& matches) const;
  void
  prepareNormals(const std::vector<int>& targets);
  Eigen::Vector3f
  fitNormal(int target) const;
  void
  fillPlanes(const SourcePoints& source, const Pose& pose, const Eigen::Vector3d& center,
             Matches& matches) const;
  void
  fillPoints(std::size_t size, const Eigen::Vector3d& center, Matches& matches) const;

  const AlignmentProblem& problem_;
  std::vector<Eigen::Vector3f> normals_; // of the target, NaN where it is not planar
  std::vector<char> known_;              // which normals have been computed
  bool planar_ = true;
};

} // namespace bundle_icp
