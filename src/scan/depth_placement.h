// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/check_images.h"

#include <string>
#include <vector>

namespace bundle_icp {

/** Where depth lies on colour, as a change of the depth image that brings its edges onto those of
 *  the colour image: mirrored, then zoomed about the centre, then moved. */
struct DepthPlacement {
  enum class Flip { NONE, SIDEWAYS, UPSIDE_DOWN, TURNED };

  Flip flip = Flip::NONE;
  double zoom = 1;
  cv::Point shift; ///< [px of the images of edges]
};

/** In words, with the shift in pixels of the images.
 *  \param scale width of the images over that of the images of edges */
std::string
toString(const DepthPlacement& placement, double scale);

/** How well the placed depth edges of a frame lie on its colour edges, -1 to 1. */
double
agreement(const FrameLook& look, const DepthPlacement& placement);

/** The placement of the largest mean agreement, among shifts up to a quarter of the image, mirror
 *  images, and zooms of a quarter to either side: by cross-correlation of the edges.
 *  \param looks with edges, of one size; at least one */
DepthPlacement
bestPlacement(const std::vector<FrameLook>& looks, int num_threads);

} // namespace bundle_icp
