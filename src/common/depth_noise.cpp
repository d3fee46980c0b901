// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/depth_noise.h>

#include <cmath>
#include <utility>

namespace bundle_icp {
namespace {

const std::pair<const char*, DepthNoise> SENSORS[] = {{"kinect", {}},
                                                      {"d400", {0.000611, 0.003587, 0.3515}},
                                                      {"tof", {0.00129, 0.0003, 0.83}},
                                                      {"lidar", {0.00234, 0.0001625, 0}}};

} // namespace

bool
DepthNoise::isValid(std::string* error) const
{
  if (std::isfinite(constant) && constant > 0 && std::isfinite(quadratic) && quadratic >= 0 &&
      std::isfinite(offset))
    return true;
  if (error)
    *error = "depth noise needs a finite constant > 0 m and a finite quadratic term >= 0";
  return false;
}

std::optional<DepthNoise>
depthNoiseOf(const std::string& sensor)
{
  for (const auto& [name, noise] : SENSORS)
    if (name == sensor)
      return noise;
  return std::nullopt;
}

std::string
sensorName(const DepthNoise& noise)
{
  for (const auto& [name, known] : SENSORS)
    if (known.constant == noise.constant && known.quadratic == noise.quadratic &&
        known.offset == noise.offset)
      return name;
  return "custom";
}

} // namespace bundle_icp
