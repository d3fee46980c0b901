// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/still_camera.h"

#include "refinement/spread.h"

#include <algorithm>

namespace bundle_icp {
namespace {

/** Largest motion of what is seen in the middle of the image, as a share of the focal length, from
 *  turning and from moving each: some five pixels. Hands that hold a camera still move it by more.
 */
constexpr double HARDLY_MOVES = 0.01;
/** Share of the frames that must be so close together: a single pose may be wrong. */
constexpr double NEARLY_ALL = 0.9;

} // namespace

std::optional<StillCamera>
findStillCamera(const ImageGraph& graph, const SparseModel& model, int component)
{
  const std::vector<std::size_t> frames = model.registeredFrames(component);
  std::vector<double> along[3], depths;
  for (const std::size_t frame : frames) {
    for (int axis = 0; axis < 3; ++axis)
      along[axis].push_back(model.worldFromCamera(frame).translation()[axis]);
    for (const float depth : graph.features(frame).depths)
      if (depth > 0)
        depths.push_back(depth);
  }
  if (depths.empty())
    return std::nullopt;
  const Eigen::Vector3d center(medianOf(along[0]), medianOf(along[1]), medianOf(along[2]));
  const auto distance = [&](std::size_t frame) {
    return (model.worldFromCamera(frame).translation() - center).norm();
  };
  const std::size_t middle =
      *std::min_element(frames.begin(), frames.end(),
                        [&](std::size_t a, std::size_t b) { return distance(a) < distance(b); });
  const double reach = HARDLY_MOVES * medianOf(depths);
  StillCamera still;
  for (const std::size_t frame : frames) {
    const Pose motion = model.worldFromCamera(middle).inverse() * model.worldFromCamera(frame);
    const double moved = motion.translation().norm(), turned = rotationAngle(motion);
    if (moved > reach || turned > HARDLY_MOVES)
      continue;
    ++still.frames;
    still.distance = std::max(still.distance, moved);
    still.angle = std::max(still.angle, turned);
  }
  if (double(still.frames) < NEARLY_ALL * double(frames.size()))
    return std::nullopt;
  return still;
}

} // namespace bundle_icp
