// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/depth_alignment.h"

namespace bundle_icp {
namespace {

/** An adjustment weighs hundreds of pairs against each other and against matches: chance in one
 *  pair's residuals would decide between the pairs. */
constexpr double PAIR_MODEL_SHARE = 0.7;
/** Largest misalignment of a start that is trusted [m]. */
constexpr double TRUSTED_MISALIGNMENT = 0.03;

} // namespace

DepthAlignment::DepthAlignment(const View& source, const VirtualDepthOptions& options)
: rendering_(options), source_cloud_(toPointCloud(*source))
{
  problem_.source = viewPoints(*source_cloud_);
  problem_.camera = source->camera;
  problem_.num_threads = options.num_threads;
}

void
DepthAlignment::setVisualEvidence(const VisualCorrespondences& matches, double scale)
{
  problem_.visual = matches;
  problem_.visual_scale = scale;
}

PointsView
DepthAlignment::render(const Pose& world_from_virtual)
{
  target_cloud_ = toPointCloud(
      renderVirtualDepth(registered_, *problem_.camera, world_from_virtual, rendering_));
  return viewPoints(*target_cloud_);
}

void
DepthAlignment::setVirtualDepth(const std::vector<View>& views,
                                const std::vector<Pose>& world_from_views, const Pose& start)
{
  views_ = views;
  for (std::size_t i = 0; i < views.size(); ++i)
    registered_.push_back({views[i].get(), world_from_views[i]});
  problem_.world_from_virtual = start;
  problem_.target = render(start);
  problem_.render = [this](const Pose& pose) { return std::make_optional(render(pose)); };
}

void
DepthAlignment::trustStart()
{
  problem_.max_misalignment = TRUSTED_MISALIGNMENT;
}

void
DepthAlignment::setView(const DepthView& view)
{
  target_cloud_ = toPointCloud(view);
  problem_.target = viewPoints(*target_cloud_);
  problem_.max_misalignment = 0;
  problem_.model_share = PAIR_MODEL_SHARE;
}

} // namespace bundle_icp
