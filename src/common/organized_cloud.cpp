// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/organized_cloud.h>

#include "common/pinhole_fit.h"

#include <bundle_icp/common/exceptions.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <locale>
#include <sstream>

namespace bundle_icp {
namespace {

/** Largest deviation of points from the pixels of a pinhole camera [px]. */
constexpr double MAX_DEVIATION = 0.5;

/** Points this share of the width away from their pixels are in another frame: no calibration
 *  differs as much from the nominal camera that a driver makes points with. */
constexpr double FAR_SHARE = 0.1;

bool
isOrganized(const ColorCloud& cloud)
{
  return cloud.width >= 2 && cloud.height >= 2 &&
         cloud.size() == std::size_t(cloud.width) * cloud.height;
}

bool
isMeasured(const pcl::PointXYZRGBA& point)
{
  return point.z > 0 && point.getVector3fMap().allFinite();
}

/** Calls visit(u, v, point) for each measured point. */
template <typename Visit>
void
forEachMeasured(const ColorCloud& cloud, const Visit& visit)
{
  for (int v = 0; v < int(cloud.height); ++v)
    for (int u = 0; u < int(cloud.width); ++u)
      if (const pcl::PointXYZRGBA& point = cloud(u, v); isMeasured(point))
        visit(u, v, point);
}

/** Focal length and centre along one axis that bring points to their pixels. */
struct Axis {
  double focal_length = 0, centre = 0, deviation = 0;
};

Axis
fitAxis(const ColorCloud& cloud, int axis)
{
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  double squares = 0, count = 0;
  forEachMeasured(cloud, [&](int u, int v, const pcl::PointXYZRGBA& point) {
    const double pixel = axis == 0 ? u : v;
    const Eigen::Vector2d row(double(point.data[axis]) / double(point.z), 1);
    normal += row * row.transpose();
    right += row * pixel;
    squares += pixel * pixel;
    ++count;
  });
  if (count < 100 || std::abs(normal.determinant()) < 1e-9 * count * count)
    return {0, 0, std::numeric_limits<double>::infinity()};
  const Eigen::Vector2d solution = normal.ldlt().solve(right);
  const double residual = squares - solution.dot(right);
  return {solution.x(), solution.y(), std::sqrt(std::max(0., residual) / count)};
}

bool
isFarFromPixels(const ColorCloud& cloud, const CameraIntrinsics& camera)
{
  std::size_t points = 0, far = 0;
  forEachMeasured(cloud, [&](int u, int v, const pcl::PointXYZRGBA& point) {
    const Eigen::Vector2d pixel = camera.project(point.getVector3fMap().cast<double>());
    far += (pixel - Eigen::Vector2d(u, v)).norm() > FAR_SHARE * camera.width;
    ++points;
  });
  return 2 * far > points;
}

[[noreturn]] void
refuse(const char* function, const std::string& reason)
{
  throw BadArgumentException(std::string(function) + ": " + reason);
}

void
checkOrganized(const char* function, const ColorCloud& cloud)
{
  if (!isOrganized(cloud))
    refuse(function, "the cloud is not organized: " + std::to_string(cloud.size()) + " points in " +
                         std::to_string(cloud.width) + " columns and " +
                         std::to_string(cloud.height) + " rows");
}

} // namespace

CloudImages
imagesOf(const ColorCloud& cloud)
{
  const cv::Size size(int(cloud.width), int(cloud.height));
  CloudImages images{cv::Mat(size, CV_8UC3), cv::Mat(size, CV_32FC1)};
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u) {
      const pcl::PointXYZRGBA& point = cloud(u, v);
      images.color.at<cv::Vec3b>(v, u) = {point.b, point.g, point.r};
      images.depth.at<float>(v, u) =
          isMeasured(point) ? point.z : std::numeric_limits<float>::quiet_NaN();
    }
  return images;
}

PinholeFit
fitPinhole(const ColorCloud& cloud)
{
  const Axis x = fitAxis(cloud, 0), y = fitAxis(cloud, 1);
  PinholeFit fit;
  fit.camera.width = int(cloud.width);
  fit.camera.height = int(cloud.height);
  fit.camera.fx = x.focal_length;
  fit.camera.fy = y.focal_length;
  fit.camera.cx = x.centre;
  fit.camera.cy = y.centre;
  fit.deviation = std::max(x.deviation, y.deviation);
  return fit;
}

std::string
faultOf(const PinholeFit& fit)
{
  if (!std::isfinite(fit.deviation))
    return "has hardly a point, or all lie in one row or column";
  if (fit.deviation <= MAX_DEVIATION && fit.camera.fx > 0 && fit.camera.fy > 0)
    return "";
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << std::setprecision(4)
       << "the points are not those of a camera that looks along z, x right and y down: the "
          "pinhole camera that fits best has fx "
       << fit.camera.fx << " px, fy " << fit.camera.fy << " px, and misses the pixels by "
       << std::setprecision(3) << fit.deviation << " px; clouds must be in the frame of the camera";
  return text.str();
}

RGBDFrame
toFrame(const ColorCloud& cloud, const CameraIntrinsics& camera, double timestamp)
{
  checkOrganized("toFrame", cloud);
  std::string error;
  if (!camera.isValid(&error))
    refuse("toFrame", error);
  if (camera.hasDistortion())
    refuse("toFrame", "the camera of a cloud has no distortion");
  if (int(cloud.width) != camera.width || int(cloud.height) != camera.height)
    refuse("toFrame", "the cloud has " + std::to_string(cloud.width) + " x " +
                          std::to_string(cloud.height) + " points, the camera " +
                          std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                          " pixels");
  if (isFarFromPixels(cloud, camera))
    refuse("toFrame", "most points lie far from their pixels; clouds must be in the frame of the "
                      "camera, x right, y down, z forward, in metres");
  const CloudImages images = imagesOf(cloud);
  RGBDFrame frame;
  frame.timestamp = timestamp;
  frame.color = images.color;
  frame.depth = images.depth;
  return frame;
}

CameraIntrinsics
intrinsicsOf(const ColorCloud& cloud)
{
  checkOrganized("intrinsicsOf", cloud);
  const PinholeFit fit = fitPinhole(cloud);
  std::string fault = faultOf(fit);
  if (!fault.empty() || !fit.camera.isValid(&fault))
    refuse("intrinsicsOf", fault);
  return fit.camera;
}

} // namespace bundle_icp
