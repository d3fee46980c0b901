// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/graph/feature_matching.h>

#include <vector>

namespace bundle_icp {

/** Two frames and the features that they share; some may be false. */
struct MatchedFrames {
  std::size_t first = 0, second = 0;
  std::vector<FeatureMatch> matches;
};

/** What matched points say of the focal length. */
struct FocalLength {
  double factor = 1;         ///< of the nominal fx and fy
  double deviation = 0;      ///< standard deviation of the factor, over the factor
  std::size_t num_pairs = 0; ///< of frames that say something
  bool is_determined = false;
};

/** The focal length with which points of different frames meet: a wrong one bends the measured
 *  points of a frame, and only where the camera turns are they bent another way in the next frame.
 *  Each pair of frames gets the motion that fits best; what remains, in standard deviations of
 *  pixels and depth, is least at the true focal length. Errors that each depth image has as a
 *  whole are estimated with it.
 *  \param features of each frame
 *  \param lowest, highest factors of the nominal focal length between which it is looked for */
FocalLength
estimateFocalLength(const std::vector<Features>& features, const std::vector<MatchedFrames>& pairs,
                    const CameraIntrinsics& camera, double lowest, double highest, int num_threads);

} // namespace bundle_icp
