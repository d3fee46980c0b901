// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/registration/impl/point_alignment.h>
#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <memory>
#include <vector>

namespace bundle_icp {

/** Input of alignPoints() to align an image's depth with that of other images; keeps the data that
 *  the problem refers to. */
class DepthAlignment {
public:
  using View = std::shared_ptr<const DepthView>;

  DepthAlignment(const View& source, const VirtualDepthOptions& options);
  // The problem refers to this object.
  DepthAlignment(const DepthAlignment&) = delete;
  DepthAlignment&
  operator=(const DepthAlignment&) = delete;

  /** \param matches in the source's frame; the start is their robust fit
   *  \param scale RigidAlignment::scale of that fit */
  void
  setVisualEvidence(const VisualCorrespondences& matches, double scale);

  /** The target is the virtual depth of registered images, equation (6): rendered at the start, and
   *  again when the pose has moved. */
  void
  setVirtualDepth(const std::vector<View>& views, const std::vector<Pose>& world_from_views,
                  const Pose& start);

  /** The start is right within some centimetres: no other pose is looked for. */
  void
  trustStart();

  /** The target is one image, near a start that is adjusted. */
  void
  setView(const DepthView& view);

  const AlignmentProblem&
  problem() const
  {
    return problem_;
  }

private:
  using Cloud = pcl::PointCloud<pcl::PointXYZRGBNormal>;

  PointsView
  render(const Pose& world_from_virtual);

  VirtualDepthOptions rendering_;
  std::vector<View> views_; ///< held for registered_
  std::vector<RegisteredView> registered_;
  Cloud::Ptr source_cloud_, target_cloud_;
  AlignmentProblem problem_;
};

} // namespace bundle_icp
