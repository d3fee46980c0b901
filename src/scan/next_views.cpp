// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/next_views.h"

#include "common/concatenate.h"
#include "mesh/preview.h"
#include "scan/component_bridges.h"
#include "scan/read_in_order.h"
#include "scan/scan_surface.h"
#include "scan/surface_gaps.h"
#include "scan/view_candidates.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <climits>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace bundle_icp {
namespace {

constexpr int PICTURE_WIDTH = 320; // [px]
const cv::Vec3b MAGENTA(255, 0, 255);

/** The camera of an image of which every `step`-th pixel is kept, from the middle of the first step
 *  on. */
CameraIntrinsics
thinned(CameraIntrinsics camera, int step)
{
  camera.width /= step;
  camera.height /= step;
  camera.fx /= step;
  camera.fy /= step;
  camera.cx = (camera.cx - step / 2) / step;
  camera.cy = (camera.cy - step / 2) / step;
  return camera;
}

cv::Mat
thinned(const cv::Mat& depth, int step)
{
  cv::Mat few(depth.rows / step, depth.cols / step, CV_32FC1);
  for (int v = 0; v < few.rows; ++v)
    for (int u = 0; u < few.cols; ++u)
      few.at<float>(v, u) = depth.at<float>(v * step + step / 2, u * step + step / 2);
  return few;
}

/** 5 %, 50 % and 95 % of the frames' depth; 0 without any. */
std::array<double, 3>
depthQuantiles(const std::vector<SeenFrame>& frames)
{
  std::vector<float> depths;
  for (const SeenFrame& frame : frames)
    std::copy_if(frame.depth.begin<float>(), frame.depth.end<float>(), std::back_inserter(depths),
                 [](float z) { return z > 0; });
  std::array<double, 3> quantiles{};
  if (depths.empty())
    return quantiles;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto place =
        depths.begin() + std::ptrdiff_t(std::array{0.05, 0.5, 0.95}[i] * double(depths.size() - 1));
    std::nth_element(depths.begin(), place, depths.end());
    quantiles[i] = *place;
  }
  return quantiles;
}

/** Reads the depth of the frames that the surface is made of. \return false when stopped. */
bool
readFrames(const RGBDDataset& dataset, const ReconstructionResult& result,
           const std::vector<cv::Mat>& moving, const NextViewOptions& options,
           const ProgressCallback& progress, std::vector<SeenFrame>& frames)
{
  const std::vector<std::size_t> indices = framesToFuse(result);
  const int step = std::max(1, dataset.camera().width / 80);
  std::size_t done = 0;
  return readInOrder(
      dataset, indices, options.num_threads,
      [&](std::size_t index, const RGBDFrame& frame, const std::string& error) {
        if (error.empty())
          frames.push_back(
              {index, result.frames[index].world_from_depth, thinned(frame.depth, step)});
        return !progress || progress({"next views", ++done, indices.size()});
      },
      [&](std::size_t index, const RGBDFrame& frame) {
        return frameToFuse(dataset, result, moving, index, frame);
      });
}

/** Where the scan's cameras were and what they saw. */
SeenScan
seeScan(std::vector<SeenFrame> frames, const CameraIntrinsics& camera, const SurfaceMesh& mesh,
        const NextViewOptions& options)
{
  constexpr double cells_per_depth = 40, head_room = 0.15; // [m]
  const std::array<double, 3> depths = depthQuantiles(frames);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    box.extend(vertex.cast<double>());
  for (const SeenFrame& frame : frames)
    box.extend(frame.world_from_camera.translation());
  box.extend(box.min().array().matrix() - Eigen::Vector3d::Constant(2 * head_room));
  box.extend(box.max().array().matrix() + Eigen::Vector3d::Constant(2 * head_room));
  const int step = std::max(1, camera.width / 80);
  SeenScan scan{camera, thinned(camera, step), SeenSpace(box, depths[1] / cells_per_depth),
                {},     std::move(frames),     depths};
  for (const SeenFrame& frame : scan.frames) {
    scan.space.look(frame.depth, scan.depth_camera, frame.world_from_camera, options.num_threads);
    scan.space.stand(frame.world_from_camera.translation(), head_room);
  }
  scan.space.addSurface(mesh);
  scan.gaps = findGaps(mesh, scan.space, options.max_gap * depths[1], options.region);
  return scan;
}

/** The mesh as a camera sees it, with what is missing in magenta. */
cv::Mat
drawView(const SeenScan& scan, const SurfaceMesh& mesh, const Pose& world_from_camera)
{
  const double scale = double(PICTURE_WIDTH) / scan.camera.width;
  CameraIntrinsics camera = scan.camera;
  camera.width = PICTURE_WIDTH;
  camera.height = int(std::lround(scale * camera.height));
  camera.fx *= scale;
  camera.fy *= scale;
  camera.cx = scale * (camera.cx + 0.5) - 0.5;
  camera.cy = scale * (camera.cy + 0.5) - 0.5;
  cv::Mat picture = drawMesh(mesh, camera, world_from_camera);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray = camera.unproject(u, v, 1).normalized();
      auto& pixel = picture.at<cv::Vec3b>(v, u);
      if (castRay(scan, world_from_camera.translation(), world_from_camera.linear() * ray).met ==
          Met::GAP)
        pixel = 0.35 * pixel + 0.65 * MAGENTA;
    }
  return picture;
}

/** The middle of what a view shows of the gaps that are not covered: the cell next to the mean. */
Eigen::Vector3d
middleOf(const SeenScan& scan, const SeenView& view, const std::vector<std::uint8_t>& covered)
{
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [cell, area] : view.missing)
    if (!covered[cell])
      sum += area * scan.space.center(cell);
  const Eigen::Vector3d mean = sum / view.area(covered);
  Eigen::Vector3d middle = mean;
  double nearest = INFINITY;
  for (const auto& missing : view.missing)
    if (const Eigen::Vector3d center = scan.space.center(missing.first);
        !covered[missing.first] && (center - mean).norm() < nearest) {
      nearest = (center - mean).norm();
      middle = center;
    }
  return middle;
}

NextView
toNextView(const SeenScan& scan, const SurfaceMesh& mesh, const SeenView& view,
           const std::vector<std::uint8_t>& covered)
{
  const SeenFrame& frame = scan.frames[view.frame];
  const Pose frame_from_view = frame.world_from_camera.inverse() * view.world_from_camera;
  NextView next;
  next.world_from_camera = view.world_from_camera;
  next.nearest_frame = frame.index;
  next.distance = frame_from_view.translation().norm();
  next.angle = std::acos(std::clamp(frame_from_view.linear()(2, 2), -1.0, 1.0));
  next.center = middleOf(scan, view, covered);
  next.area = view.area(covered);
  next.shared = view.shared;
  next.picture = drawView(scan, mesh, view.world_from_camera);
  return next;
}

/** Appends the views that show most of what those before them do not show. */
void
chooseViews(const SeenScan& scan, const SurfaceMesh& mesh, const NextViewOptions& options,
            std::vector<NextView>& chosen)
{
  ViewSearch search(scan, options);
  std::vector<std::uint8_t> covered(scan.space.numCells(), false);
  while (chosen.size() < options.max_views) {
    const std::optional<SeenView> best = search.best(covered);
    if (!best)
      return;
    chosen.push_back(toNextView(scan, mesh, *best, covered));
    cover(scan, *best, covered);
  }
}

/** A length with its direction: one word where it is positive, another one where not; empty where
 *  it is short. */
std::string
offsetText(double offset, const char* positive, const char* negative)
{
  constexpr double shortest = 0.05; // [m]
  std::ostringstream text;
  if (std::abs(offset) >= shortest)
    text << ", " << std::fixed << std::setprecision(2) << std::abs(offset) << " m "
         << (offset > 0 ? positive : negative);
  return text.str();
}

std::string
turnText(double turn, const char* positive, const char* negative)
{
  constexpr double smallest = 0.05; // [rad]
  if (std::abs(turn) < smallest)
    return "";
  return concatenate(", turned ", std::lround(std::abs(turn) * 180 / M_PI), " deg ",
                     turn > 0 ? positive : negative);
}

std::string
frameText(const FrameReport& frame)
{
  return concatenate("frame ", frame.id, " (", frame.name, ")");
}

} // namespace

bool
NextViewOptions::isValid(std::string* error) const
{
  std::string reason;
  const auto check = [&reason](const char* name, double value, double low, double high) {
    if (reason.empty() && !(value >= low && value <= high))
      reason = concatenate(name, " ", value, "; expected ", low, " to ", high);
  };
  check("max_views", double(max_views), 1, MAX_VIEWS);
  check("min_area", min_area, 0.0001, 100);
  check("min_shared", min_shared, 0.05, 0.9);
  check("max_gap", max_gap, 0.1, 5);
  check("num_threads", num_threads, 0, INT_MAX);
  if (reason.empty() && region)
    region->isValid(&reason);
  if (error && !reason.empty())
    *error = "NextViewOptions: " + reason;
  return reason.empty();
}

const char*
toString(NextViewPurpose purpose)
{
  switch (purpose) {
  case NextViewPurpose::CLOSE_HOLE:
    return "close_hole";
  case NextViewPurpose::CONNECT_COMPONENT:
    return "connect_component";
  }
  return "";
}

std::string
toString(const NextView& view, const ReconstructionResult& result)
{
  const FrameReport& nearest = result.frames.at(view.nearest_frame);
  if (view.purpose == NextViewPurpose::CONNECT_COMPONENT)
    return concatenate("between ", frameText(nearest), " and ",
                       frameText(result.frames.at(view.other_frame)),
                       ": views from the one to the other would connect the ",
                       result.component_sizes.at(std::size_t(view.component)),
                       " frames of component ", view.component);
  const Pose frame_from_view = nearest.world_from_camera.inverse() * view.world_from_camera;
  const Eigen::Vector3d offset = frame_from_view.translation(),
                        axis = frame_from_view.linear().col(2);
  const Eigen::Vector3d center = view.world_from_camera.inverse() * view.center;
  std::ostringstream what;
  what << std::fixed << std::setprecision(2) << ": shows " << view.area
       << " m2 that no frame has seen, " << center.norm() << " m away";
  return "as " + frameText(nearest) + offsetText(offset.x(), "to its right", "to its left") +
         offsetText(offset.y(), "down", "up") + offsetText(offset.z(), "forward", "back") +
         turnText(std::atan2(axis.x(), axis.z()), "right", "left") +
         turnText(std::asin(std::clamp(axis.y(), -1.0, 1.0)), "down", "up") + what.str();
}

bool
suggestViews(const RGBDDataset& dataset, const ReconstructionResult& result,
             const std::vector<cv::Mat>& moving, const NextViewOptions& options,
             const ProgressCallback& progress, std::vector<NextView>& views)
{
  views = bridgeComponents(dataset, result, (options.max_views + 1) / 2, options.num_threads);
  for (NextView& view : views)
    view.picture = drawFrames(dataset, view.nearest_frame, view.other_frame, PICTURE_WIDTH);
  if (result.mesh.polygons.empty())
    return true;
  std::vector<SeenFrame> frames;
  if (!readFrames(dataset, result, moving, options, progress, frames))
    return false;
  if (depthQuantiles(frames)[0] > 0) {
    const SurfaceMesh mesh = toSurfaceMesh(result.mesh);
    const CameraIntrinsics camera = result.model.calibration().corrected(dataset.camera());
    chooseViews(seeScan(std::move(frames), camera, mesh, options), mesh, options, views);
  }
  return true;
}

std::vector<NextView>
suggestViews(const RGBDDataset& dataset, const ReconstructionResult& result,
             const NextViewOptions& options, const ProgressCallback& progress)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("suggestViews: " + error);
  if (dataset.size() != result.frames.size())
    throw BadArgumentException(concatenate("suggestViews: the result is of ", result.frames.size(),
                                           " frames, the dataset has ", dataset.size()));
  std::vector<NextView> views;
  suggestViews(dataset, result, {}, options, progress, views);
  return views;
}

} // namespace bundle_icp
