// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/camera_faults.h"

#include "simulation/moving_things.h"
#include "simulation/path.h"
#include "simulation/renderer.h"
#include "simulation/scene.h"
#include "simulation/visible_surface.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <opencv2/imgproc.hpp>

#include <cmath>
#include <numeric>

namespace bundle_icp {

using simulation::GeometryImage;

struct SyntheticScan::Impl {
  explicit Impl(const SyntheticScanOptions& scan_options);

  /** Time of a frame of the recording on the path [s]. */
  double
  timeOf(std::size_t id) const
  {
    return double(id) / options.frame_rate;
  }

  /** world_from_camera, where the world is the turntable if there is one. */
  Pose
  poseAt(double time) const
  {
    const Pose room_from_camera = path.at(options.still || options.turntable ? 0 : time);
    return worldFromRoom(time) * room_from_camera;
  }

  Pose
  worldFromRoom(double time) const
  {
    return options.turntable ? simulation::roomFromTurntable(path.at(0), time).inverse()
                             : Pose::Identity();
  }

  /** Colour image of a frame, its rows exposed one after the other, moved by `motion`. */
  cv::Mat
  sharpColor(std::size_t id, const Pose& motion = Pose::Identity()) const;
  /** Mean of what the camera sees while it is shaken. */
  cv::Mat
  blurredColor(std::size_t id) const;
  SyntheticScanOptions options;
  simulation::Scene scene;
  simulation::HandHeldPath path;
  simulation::MovingThings moving;
  CameraIntrinsics true_camera;   ///< by which images are rendered
  CameraIntrinsics camera;        ///< that is reported
  std::vector<std::size_t> order; ///< number on the path of the frame at each index
};

SyntheticScan::Impl::Impl(const SyntheticScanOptions& scan_options)
: options(scan_options),
  scene(options.turntable ? simulation::turntableScene(options)
                          : simulation::Scene(options.seed, options.texture)),
  path(options.seed, options.start_time, options.movement),
  moving(options, [this](double time) { return worldFromRoom(time); }),
  true_camera(scan_options.trueCamera()), camera(true_camera), order(scan_options.num_frames)
{
  camera.fx = camera.fy = options.focal_length * (1 + options.focal_error);
  std::iota(order.begin(), order.end(), std::size_t(0));
  if (!options.unordered)
    return;
  for (std::size_t i = order.size(); i > 1; --i) {
    cv::RNG random = simulation::frameRandom(options.seed, i, 0x0de4);
    std::swap(order[i - 1], order[std::size_t(random.uniform(0, int(i)))]);
  }
}

cv::Mat
SyntheticScan::Impl::sharpColor(std::size_t id, const Pose& motion) const
{
  // Bands of so few rows that the camera moves by a fraction of a pixel
  const int band_height = options.readout == 0 ? options.height : 4;
  cv::Mat color(options.height, options.width, CV_8UC3);
  for (int y = 0; y < options.height; y += band_height) {
    const cv::Range rows(y, std::min(y + band_height, options.height));
    // With the neighbours of its rows, by which edges are found
    const cv::Range seen(std::max(rows.start - 1, 0), std::min(rows.end + 1, options.height));
    CameraIntrinsics band = true_camera;
    band.height = seen.size();
    band.cy -= seen.start;
    const double row = 0.5 * (rows.start + rows.end - 1);
    const double delay = options.readout * ((row + 0.5) / options.height - 0.5);
    const double time = timeOf(id) + delay;
    const Pose pose = poseAt(time) * motion;
    GeometryImage geometry = simulation::renderGeometry(scene, band, pose);
    cv::Mat band_color = simulation::renderColor(scene, band, pose, geometry);
    moving.draw(band, pose, time, geometry.depth, &band_color);
    band_color.rowRange(rows.start - seen.start, rows.end - seen.start)
        .copyTo(color.rowRange(rows));
  }
  return color;
}

cv::Mat
SyntheticScan::Impl::blurredColor(std::size_t id) const
{
  const std::vector<Pose> shake = simulation::drawShake(options, id);
  cv::Mat sum(options.height, options.width, CV_32FC3, cv::Scalar::all(0)), color;
  for (const Pose& motion : shake) {
    sharpColor(id, motion).convertTo(color, CV_32F);
    sum += color;
  }
  sum.convertTo(color, CV_8UC3, 1.0 / double(shake.size()));
  return color;
}

SyntheticScan::SyntheticScan(const SyntheticScanOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("synthetic scan: " + error);
  impl_ = std::make_unique<Impl>(options);
}

SyntheticScan::~SyntheticScan() = default;

std::size_t
SyntheticScan::size() const
{
  return impl_->options.num_frames;
}

const CameraIntrinsics&
SyntheticScan::camera() const
{
  return impl_->camera;
}

std::size_t
SyntheticScan::id(std::size_t index) const
{
  return index;
}

double
SyntheticScan::timestamp(std::size_t index) const
{
  return impl_->timeOf(index);
}

std::string
SyntheticScan::name(std::size_t index) const
{
  return "synthetic frame " + std::to_string(id(index));
}

RGBDFrame
SyntheticScan::read(std::size_t index) const
{
  const SyntheticScanOptions& options = impl_->options;
  const std::size_t number = impl_->order.at(index);
  const double time = impl_->timeOf(number);
  RGBDFrame frame;
  frame.id = id(index);
  frame.timestamp = timestamp(index);
  const Pose depth_pose = impl_->poseAt(time + options.time_offset);
  const GeometryImage geometry =
      simulation::renderGeometry(impl_->scene, impl_->true_camera, depth_pose);
  const bool is_same_view = !isBlurred(index) && options.time_offset == 0 && options.readout == 0;
  if (is_same_view)
    frame.color = simulation::renderColor(impl_->scene, impl_->true_camera, depth_pose, geometry);
  else
    frame.color = isBlurred(index) ? impl_->blurredColor(number) : impl_->sharpColor(number);
  frame.depth = geometry.depth.clone(); // the reflection is that of what stands still
  impl_->moving.draw(impl_->true_camera, depth_pose, time + options.time_offset, frame.depth,
                     is_same_view ? &frame.color : nullptr);
  cv::Mat reflection;
  if (options.hole_fraction > 0)
    reflection =
        simulation::reflection(impl_->scene, impl_->true_camera, depth_pose, geometry, frame.color);
  simulation::spoilDepth(frame.depth, reflection, options, number);
  simulation::spoilColor(frame.color, options, number, time);
  return frame;
}

cv::Mat
SyntheticScan::readDepth(std::size_t index) const
{
  const SyntheticScanOptions& options = impl_->options;
  const std::optional<DepthCamera> depth_camera = options.depthCamera();
  if (!depth_camera)
    return read(index).depth;
  const CameraIntrinsics& camera = depth_camera->intrinsics;
  const std::size_t number = impl_->order.at(index);
  const double time = impl_->timeOf(number) + options.time_offset;
  const Pose pose = impl_->poseAt(time) * depth_camera->color_from_depth;
  const GeometryImage geometry = simulation::renderGeometry(impl_->scene, camera, pose);
  cv::Mat depth = geometry.depth.clone(); // the reflection is that of what stands still
  impl_->moving.draw(camera, pose, time, depth, nullptr);
  cv::Mat reflection;
  if (options.hole_fraction > 0) {
    const cv::Mat color = simulation::renderColor(impl_->scene, camera, pose, geometry);
    reflection = simulation::reflection(impl_->scene, camera, pose, geometry, color);
  }
  simulation::spoilDepth(depth, reflection, options, number);
  return depth;
}

std::optional<DepthCamera>
SyntheticScan::depthCamera() const
{
  return impl_->options.depthCamera();
}

bool
SyntheticScan::isOrdered() const
{
  return !impl_->options.unordered;
}

std::string
SyntheticScan::format() const
{
  return "synthetic";
}

Trajectory
SyntheticScan::groundTruth() const
{
  Trajectory trajectory;
  for (std::size_t i = 0; i < size(); ++i)
    trajectory.push_back({timestamp(i), worldFromCamera(i)});
  return trajectory;
}

Pose
SyntheticScan::worldFromCamera(std::size_t index) const
{
  return impl_->poseAt(impl_->timeOf(impl_->order.at(index)));
}

bool
SyntheticScan::isBlurred(std::size_t index) const
{
  return simulation::drawBlurred(impl_->options, impl_->order.at(index));
}

RGBDFrame
SyntheticScan::readExact(std::size_t index) const
{
  RGBDFrame frame = render(worldFromCamera(index));
  frame.id = id(index);
  frame.timestamp = timestamp(index);
  return frame;
}

cv::Mat
SyntheticScan::mask(std::size_t index) const
{
  const Pose pose = worldFromCamera(index);
  const cv::Mat depth = render(pose).depth;
  cv::Mat covered = impl_->moving.coverage(impl_->true_camera, pose,
                                           impl_->timeOf(impl_->order.at(index)), depth);
  cv::dilate(covered, covered, cv::getStructuringElement(cv::MORPH_RECT, {5, 5}));
  return covered == 0;
}

RGBDFrame
SyntheticScan::render(const Pose& world_from_camera) const
{
  const GeometryImage geometry =
      simulation::renderGeometry(impl_->scene, impl_->true_camera, world_from_camera);
  RGBDFrame frame;
  frame.depth = geometry.depth;
  frame.color =
      simulation::renderColor(impl_->scene, impl_->true_camera, world_from_camera, geometry);
  return frame;
}

double
SyntheticScan::distanceToSurface(const Eigen::Vector3d& point) const
{
  return impl_->scene.distanceToSurface(point);
}

SyntheticScan::SurfaceCloud::Ptr
SyntheticScan::visibleSurface(double spacing, int num_threads) const
{
  if (!std::isfinite(spacing) || spacing < 0.001)
    throw BadArgumentException("visible surface: spacing of " + std::to_string(spacing) +
                               " m, expected at least 0.001 m");
  const auto step = std::size_t(std::max(1.0, std::round(0.1 * impl_->options.frame_rate)));
  std::vector<Pose> poses;
  for (std::size_t number = 0; number < size(); number += step)
    poses.push_back(impl_->poseAt(impl_->timeOf(number)));
  return simulation::visibleSurface(impl_->scene, impl_->true_camera, poses, spacing, num_threads);
}

} // namespace bundle_icp
