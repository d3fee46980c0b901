// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/simulation/synthetic_scan.h>

#include "simulation/scan_layouts.h"

#include <cmath>
#include <sstream>

namespace bundle_icp {
namespace {

struct Bound {
  const char* name;
  double value, least, most;
};

template <std::size_t N>
bool
areWithin(const Bound (&bounds)[N], std::string* error)
{
  for (const Bound& bound : bounds) {
    if (std::isfinite(bound.value) && bound.value >= bound.least && bound.value <= bound.most)
      continue;
    if (error) {
      std::ostringstream message;
      message << bound.name << " is " << bound.value << ", expected " << bound.least << " to "
              << bound.most;
      *error = message.str();
    }
    return false;
  }
  return true;
}

} // namespace

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
  const Bound bounds[] = {
      {"num_frames", double(num_frames), 1, 1e6},
      {"frame_rate [Hz]", frame_rate, 0.1, 1000},
      {"width [px]", double(width), 16, 8192},
      {"height [px]", double(height), 16, 8192},
      {"depth_width [px]", double(depth_width == 0 ? width : depth_width), 16, 8192},
      {"depth_height [px]", double(depth_height == 0 ? height : depth_height), 16, 8192},
      {"depth_offset [m]", depth_offset.norm(), 0, 1},
      {"start_time [s]", start_time, 0, 1e6},
      {"movement", movement, 0, 1},
      {"texture", texture, 0, 1},
      {"noise_factor", noise_factor, 0, 100},
      {"quantisation [1/m]", quantisation, 0, 0.1},
      {"hole_fraction", hole_fraction, 0, 0.95},
      {"color_noise", color_noise, 0, 128},
      {"blur_fraction", blur_fraction, 0, 1},
      {"exposure_change", exposure_change, 0, 0.9},
      {"depth_bias [1/m]", depth_bias, -0.1, 0.1},
      {"focal_error", focal_error, -0.5, 0.5},
      {"time_offset [s]", time_offset, -1, 1},
      {"readout [s]", readout, -0.1, 0.1},
  };
  if (!areWithin(bounds, error) || !noise.isValid(error) || !trueCamera().isValid(error))
    return false;
  const std::optional<DepthCamera> depth = depthCamera();
  if (depth && gripper) {
    if (error)
      *error = "a gripper is simulated with registered depth only";
    return false;
  }
  return !depth || depth->intrinsics.isValid(error);
}

CameraIntrinsics
SyntheticScanOptions::trueCamera() const
{
  CameraIntrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = focal_length;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  return camera;
}

std::optional<DepthCamera>
SyntheticScanOptions::depthCamera() const
{
  if (depth_width == 0 && depth_height == 0 && depth_focal_length == 0 && depth_offset.isZero(0))
    return std::nullopt;
  DepthCamera depth;
  CameraIntrinsics& camera = depth.intrinsics;
  camera.width = depth_width == 0 ? width : depth_width;
  camera.height = depth_height == 0 ? height : depth_height;
  const double same_view = focal_length * camera.width / width;
  camera.fx = camera.fy = depth_focal_length == 0 ? same_view : depth_focal_length;
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  depth.color_from_depth.translation() = depth_offset;
  return depth;
}

bool
SyntheticScanWriteOptions::isValid(std::string* error) const
{
  if (!findScanLayout(format)) {
    if (error)
      *error = "format '" + format + "' is unknown, expected " + syntheticScanFormats();
    return false;
  }
  const Bound bounds[] = {
      {"num_threads", double(num_threads), 0, 1024},
      // 0 means no surface
      {"surface_spacing [m]", surface_spacing == 0 ? 1 : surface_spacing, 0.001, 1}};
  return areWithin(bounds, error);
}

std::string
syntheticScanFormats()
{
  std::string names;
  for (const ScanLayout& layout : scanLayouts())
    names += (names.empty() ? "" : ", ") + std::string(layout.name);
  return names;
}

} // namespace bundle_icp
