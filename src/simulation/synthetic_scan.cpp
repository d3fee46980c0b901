// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/path.h"
#include "simulation/renderer.h"
#include "simulation/scene.h"

#include <bundle_icp/simulation/synthetic_scan.h>

#include <pcl/exceptions.h>

#include <cmath>

namespace bundle_icp {

using simulation::GeometryImage;

SyntheticScanOptions
SyntheticScanOptions::fullNoise()
{
  SyntheticScanOptions options;
  options.noise_factor = 1;
  options.quantisation = 0.0028;
  options.hole_fraction = 0.05;
  options.flying_pixels = true;
  options.color_noise = 2;
  options.blur_fraction = 0.05;
  options.exposure_change = 0.15;
  return options;
}

bool
SyntheticScanOptions::isValid(std::string* error) const
{
  return noise.isValid(error);
}

struct SyntheticScan::Impl {
  explicit Impl(const SyntheticScanOptions& scan_options)
      : options(scan_options), scene(scan_options.seed), path(scan_options.seed)
  {
    true_camera.width = options.width;
    true_camera.height = options.height;
    true_camera.fx = true_camera.fy = options.focal_length;
    true_camera.cx = 0.5 * (options.width - 1);
    true_camera.cy = 0.5 * (options.height - 1);
    camera = true_camera;
    camera.fx = camera.fy = options.focal_length * (1 + options.focal_error);
  }

  SyntheticScanOptions options;
  simulation::Scene scene;
  simulation::HandHeldPath path;
  CameraIntrinsics true_camera; ///< by which images are rendered
  CameraIntrinsics camera;      ///< that is reported
};

SyntheticScan::SyntheticScan(const SyntheticScanOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw pcl::BadArgumentException("synthetic scan: " + error);
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
  return double(index) / impl_->options.frame_rate;
}

std::string
SyntheticScan::name(std::size_t index) const
{
  return "synthetic frame " + std::to_string(id(index));
}

RGBDFrame
SyntheticScan::read(std::size_t index) const
{
  return readExact(index);
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
  return impl_->path.at(double(index) / impl_->options.frame_rate);
}

bool
SyntheticScan::isBlurred(std::size_t) const
{
  return false;
}

RGBDFrame
SyntheticScan::readExact(std::size_t index) const
{
  RGBDFrame frame = render(worldFromCamera(index));
  frame.id = id(index);
  frame.timestamp = timestamp(index);
  return frame;
}

RGBDFrame
SyntheticScan::render(const Pose& world_from_camera) const
{
  const GeometryImage geometry =
      simulation::renderGeometry(impl_->scene, impl_->true_camera, world_from_camera);
  RGBDFrame frame;
  frame.depth = geometry.depth;
  frame.color = simulation::renderColor(impl_->scene, impl_->true_camera,
                                        world_from_camera, geometry);
  return frame;
}

double
SyntheticScan::distanceToSurface(const Eigen::Vector3d& point) const
{
  return impl_->scene.distanceToSurface(point);
}

} // namespace bundle_icp
