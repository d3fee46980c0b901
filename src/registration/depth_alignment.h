// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/registration/point_alignment.h>
#include <bundle_icp/registration/virtual_depth.h>

#include <memory>
#include <vector>

namespace bundle_icp {

/** Aligns an image's depth with that of others: lines 3 to 7 of Algorithm 1 for depth images, of which it
 *  keeps what alignPoints() needs. */
class DepthAlignment {
public:
  using View = std::shared_ptr<const DepthView>;

  DepthAlignment(const View& source, const VirtualDepthOptions& options);
  // The problem refers to this object.
  DepthAlignment(const DepthAlignment&) = delete;
  DepthAlignment&
  operator=(const DepthAlignment&) = delete;

  /** \param matches in the source's frame; the start of align() is their robust fit
   *  \param scale VisualPose::scale of that fit */
  void
  setVisualEvidence(const VisualCorrespondences& matches, double scale);

  /** Against the virtual depth of registered images, equation (6): rendered at the start, and anew when
   *  the pose has moved from there. \return world_from_source */
  Alignment
  alignToVirtualDepth(const std::vector<View>& views, const std::vector<Pose>& world_from_views, const Pose& start);

  /** Against one image, near a start that is adjusted. \return view_from_source */
  Alignment
  alignToView(const DepthView& view, const Pose& start);

private:
  using Cloud = pcl::PointCloud<pcl::PointXYZRGBNormal>;

  Cloud::Ptr source_cloud_, target_cloud_;
  VirtualDepthOptions rendering_;
  AlignmentProblem problem_;
};

} // namespace bundle_icp
