// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "graph/feature_checks.h"

#include <bundle_icp/common/exceptions.h>

#include <opencv2/core.hpp>

#include <cmath>

namespace bundle_icp {
namespace {

std::string
faultOfDescriptors(const cv::Mat& descriptors)
{
  if (descriptors.type() != CV_8UC1 || descriptors.cols != DESCRIPTOR_SIZE)
    return "the descriptors are " + std::to_string(descriptors.cols) + " numbers of type " +
           cv::typeToString(descriptors.type()) + "; they must be 128 of CV_8UC1 (toDescriptors())";
  double largest = 0;
  if (!descriptors.empty())
    cv::minMaxIdx(descriptors, nullptr, &largest);
  return largest > LARGEST_IN_DESCRIPTOR ? "a descriptor holds a number above 127 (toDescriptors())"
                                         : "";
}

std::string
faultOfSizes(const Features& features)
{
  const std::size_t size = features.size();
  if (std::size_t(features.descriptors.rows) != size || features.pixel_sigmas.size() != size ||
      features.depths.size() != size || features.depth_sigmas.size() != size ||
      features.colors.size() != size ||
      (!features.depth_slopes.empty() && features.depth_slopes.size() != size))
    return "pixels, sigmas, depths, colours and descriptors differ in number";
  return "";
}

bool
isPositive(float number)
{
  return std::isfinite(number) && number > 0;
}

std::string
faultOfOne(const Features& features, std::size_t j, const CameraIntrinsics& camera)
{
  if (!features.pixels[j].allFinite() || !camera.contains(features.pixels[j].cast<double>()))
    return "its position lies outside the image";
  if (!isPositive(features.pixel_sigmas[j]))
    return "the deviation of its position must be positive";
  if (std::isinf(features.depths[j]))
    return "its depth is infinite; NaN means none";
  if (features.hasDepth(j) && !isPositive(features.depth_sigmas[j]))
    return "the deviation of its depth must be positive";
  if (!features.depthSlope(j).allFinite())
    return "the slope of its depth is not finite";
  return "";
}

} // namespace

void
checkFeatureArguments(const char* function, const RGBDFrame& frame, const CameraIntrinsics& camera,
                      const FeatureOptions& options)
{
  std::string error;
  if (!options.isValid(&error) || !camera.isValid(&error))
    throw BadArgumentException(std::string(function) + ": " + error);
  const cv::Size size(camera.width, camera.height);
  if (frame.color.type() != CV_8UC3 || frame.depth.type() != CV_32FC1 ||
      frame.color.size() != size || frame.depth.size() != size)
    throw BadArgumentException(std::string(function) + ": frame " + std::to_string(frame.id) +
                               " needs CV_8UC3 colour and CV_32FC1 depth of the camera's size");
}

std::string
faultOf(const Features& features, const CameraIntrinsics& camera)
{
  if (features.size() == 0 && features.descriptors.empty())
    return faultOfSizes(features); // nothing was found
  if (const std::string fault = faultOfDescriptors(features.descriptors); !fault.empty())
    return fault;
  if (const std::string fault = faultOfSizes(features); !fault.empty())
    return fault;
  for (std::size_t j = 0; j < features.size(); ++j)
    if (const std::string fault = faultOfOne(features, j, camera); !fault.empty())
      return "feature " + std::to_string(j) + ": " + fault;
  if (!std::isfinite(features.sharpness) || features.sharpness < 0)
    return "the sharpness must be finite and not negative";
  return "";
}

} // namespace bundle_icp
