// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "virtual_depth/warp_view.h"

#include "common/depth_sigma.h"

#include <vector>

namespace bundle_icp {

/** A warped view, with the factors that turn its weights and normals to the virtual camera. */
struct Contribution {
  const DepthView* view = nullptr;
  WarpedView warped;
  Eigen::Matrix3f rotation; ///< virtual from view
  Eigen::Vector3f center;   ///< of the view, in the virtual frame
};

/** A term of equation (6): what view I_i shows of X_w, the point in a virtual pixel. */
struct ViewTerm {
  float D = 0; ///< D(X_w^i) = proj(T_w^new X_w^i), its depth in the virtual view [m]
  float w = 0; ///< w(X_w) [1/m^2], 0 = the view shows nothing there
  Eigen::Vector3f normal = Eigen::Vector3f::Zero(); ///< in the virtual frame
};

/** The term of one view in virtual pixel (u, v). An error of the measured depth moves a point along
 *  the view's ray. The angles of both rays to the surface decide how far the surface then moves
 *  along the virtual ray, and so its weight there. */
ViewTerm
viewTerm(const Contribution& from, const CameraIntrinsics& camera, int u, int v);

/** Equation (6) in one pixel: I_vir^d(X_w) = sum over the I_i in I_reg of w(X_w) D(X_w^i), over the
 *  sum of w(X_w), for those that show the nearest surface. Returned with sums of w and of normals,
 *  and w = 0 where no view shows any.
 *  \param reach how far behind the nearest depth samples are of the same surface [m] */
ViewTerm
virtualDepthAt(std::vector<ViewTerm> terms, DepthSigma reach);

/** Equation (6) for whole rows at once: the weighted average, in each virtual pixel, of the views
 *  that show the nearest surface. Fills the images of `out`. */
void
mergeViews(const std::vector<Contribution>& contributions, const VirtualDepthOptions& options,
           VirtualDepth& out);

} // namespace bundle_icp
