// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <Eigen/Core>
#include <opencv2/core/matx.hpp>

#include <string>
#include <vector>

namespace bundle_icp {

/** The colour in which a frame shows a point of the surface. */
struct ColorObservation {
  std::size_t frame = 0;
  std::size_t point = 0; ///< the same number for the same point
  cv::Vec3b color;       ///< BGR
};

/** How estimateColorGains() works. */
struct BUNDLE_ICP_EXPORT ColorGainOptions {
  double color_sigma = 0.1; ///< relative deviation of one colour, by noise and gloss, 0.001 to 1
  /** Gains stray by so much from 1, relatively: what holds frames that share nothing with
   *  others, 0.001 to 1. */
  double gain_sigma = 0.3;
  int iterations = 5; ///< of reweighting against outliers, 1 to 100

  bool
  isValid(std::string* error = nullptr) const;
};

/** Undoes the camera's choice of exposure and white balance: for each frame the factors of blue,
 *  green and red (ColorCorrection::gain) after which all frames show a point in the same colour.
 *
 *  With the logarithms y of the colours, x of the points' and g of the gains, it minimises
 *  sum ((y + g_frame - x_point) / color_sigma)^2 + sum (g / gain_sigma)^2 over all frames at once,
 *  with Cauchy weights; so that gains do not drift along the scan. Colours near black or white,
 *  where cameras clip, do not count.
 *  \param num_frames frames are numbered below it; without observations their gain is 1
 *  \throws pcl::BadArgumentException for invalid options or an observation of another frame. */
BUNDLE_ICP_EXPORT std::vector<Eigen::Vector3f>
estimateColorGains(const std::vector<ColorObservation>& observations, std::size_t num_frames,
                   const ColorGainOptions& options = {});

} // namespace bundle_icp
