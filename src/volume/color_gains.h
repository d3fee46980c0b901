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
  std::size_t point = 0; ///< all observations of a point have the same number
  cv::Vec3b color;       ///< BGR
};

/** How estimateColorGains() works. */
struct ColorGainOptions {
  double color_sigma = 0.1; ///< relative deviation of a colour by noise and gloss, 0.001 to 1
  /** Relative deviation of gains from 1; holds the gains of frames that share nothing with other
   *  frames, 0.001 to 1. */
  double gain_sigma = 0.3;
  int iterations = 5; ///< reweightings against outliers, 1 to 100

  bool
  isValid(std::string* error = nullptr) const;
};

/** Undoes the camera's choice of exposure and white balance. Each frame gets factors of blue, green
 *  and red (ColorCorrection::gain) that make all frames show a point in the same colour.
 *
 *  With the logarithms y of the colours, x of the points' colours and g of the gains, it minimises
 *  sum ((y + g_frame - x_point) / color_sigma)^2 + sum (g / gain_sigma)^2 over all frames at once,
 *  with Cauchy weights. So gains do not drift along the scan. Colours near black or white do not
 *  count, because cameras clip them.
 *  \param num_frames the frames' numbers are smaller; a frame without observations gets gain 1
 *  \throws pcl::BadArgumentException for invalid options or an observation of another frame. */
std::vector<Eigen::Vector3f>
estimateColorGains(const std::vector<ColorObservation>& observations, std::size_t num_frames,
                   const ColorGainOptions& options = {});

} // namespace bundle_icp
