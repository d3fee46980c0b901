// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <vector>

namespace bundle_icp {

/** What one registered view shows in one pixel of the virtual camera. */
struct WarpedPixel {
  float inverse_depth; ///< [1/m], of the nearest surface; 0 = nothing seen
  int source;          ///< nearest pixel of the view (row * width + column)
};

/** The same for the whole image, row by row. */
using WarpedView = std::vector<WarpedPixel>;

/** Renders the mesh of a depth view into the virtual camera. Neighbouring pixels of one
 *  surface span the mesh, so it has no holes between samples and none of it bridges an
 * edge. */
WarpedView
warpView(const DepthView& view, const CameraIntrinsics& camera, const Pose& virtual_from_view,
         const VirtualDepthOptions& options);

} // namespace bundle_icp
