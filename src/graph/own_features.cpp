// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/own_features.h>

#include "graph/feature_checks.h"

#include <bundle_icp/common/exceptions.h>

#include <opencv2/imgproc.hpp>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

namespace bundle_icp {
namespace {

/** A window holds a depth edge when a depth is farther from the window's plane than this many
 *  sigma. The plane has explained the slope, and the largest of dozens of residuals is tested. */
constexpr double EDGE_SIGMAS = 8;

/** The order of SIFT depends on its threads: features are sorted by what they are. */
std::vector<int>
canonicalOrder(const std::vector<cv::KeyPoint>& keypoints)
{
  std::vector<int> order(keypoints.size());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int i) {
    const cv::KeyPoint& k = keypoints[i];
    return std::make_tuple(k.pt.y, k.pt.x, k.size, k.angle, k.response);
  };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  return order;
}

struct MeasuredDepth {
  float depth = std::numeric_limits<float>::quiet_NaN();
  float sigma = 0;
  Eigen::Vector2f slope = Eigen::Vector2f::Zero();
};

/** Depth at a sub-pixel position: a plane through the window's depth, which averages noise
 *  and quantisation without the bias that a mean has on slanted surfaces. */
MeasuredDepth
measureDepth(const cv::Mat& depth, const CameraIntrinsics& camera, const Eigen::Vector2f& pixel,
             const FeatureOptions& options)
{
  const int r = options.depth_radius;
  const int u = int(std::lround(pixel.x())), v = int(std::lround(pixel.y()));
  if (u < r || v < r || u >= depth.cols - r || v >= depth.rows - r)
    return {};
  std::vector<Eigen::Vector3f> samples;
  samples.reserve((2 * r + 1) * (2 * r + 1));
  for (int y = v - r; y <= v + r; ++y)
    for (int x = u - r; x <= u + r; ++x)
      if (const float z = depth.at<float>(y, x); z > 0)
        samples.emplace_back(x - pixel.x(), y - pixel.y(), z);
  const std::size_t window = (2 * r + 1) * (2 * r + 1);
  if (samples.size() < 6 || 2 * samples.size() < window)
    return {};

  Eigen::Matrix3f normal = Eigen::Matrix3f::Zero();
  Eigen::Vector3f right = Eigen::Vector3f::Zero();
  for (const Eigen::Vector3f& s : samples) {
    const Eigen::Vector3f a(s.x(), s.y(), 1);
    normal += a * a.transpose();
    right += a * s.z();
  }
  const Eigen::Vector3f plane = normal.ldlt().solve(right);
  const float z = plane.z();
  if (!(z > 0))
    return {};
  const double sigma = camera.depth_noise.sigma(z);
  const double tolerance = EDGE_SIGMAS * sigma;
  for (const Eigen::Vector3f& s : samples)
    if (std::abs(plane.x() * s.x() + plane.y() * s.y() + z - s.z()) > tolerance)
      return {}; // the window holds two surfaces
  // Errors of neighbouring depth pixels are correlated, so averaging does not lower sigma; a
  // keypoint that is off by a fraction of a pixel reads another depth on a slope.
  const double slope = std::hypot(plane.x(), plane.y()) * options.pixel_sigma;
  const MeasuredDepth measured{z, float(std::hypot(sigma, slope)), plane.head<2>()};
  // Bytes that are no depth may be numbers of any size, whose deviation none can hold.
  return plane.allFinite() && std::isfinite(measured.sigma) ? measured : MeasuredDepth();
}

/** Mean squared gradient over variance, on the half-size image where sensor noise is less. */
double
measureSharpness(const cv::Mat& gray)
{
  cv::Mat half, dx, dy;
  cv::resize(gray, half, {}, 0.5, 0.5, cv::INTER_AREA);
  cv::Sobel(half, dx, CV_32F, 1, 0);
  cv::Sobel(half, dy, CV_32F, 0, 1);
  cv::Scalar mean, deviation;
  cv::meanStdDev(half, mean, deviation);
  const double energy = (dx.dot(dx) + dy.dot(dy)) / half.total();
  return energy / (deviation[0] * deviation[0] + 1);
}

void
checkKeypoints(const std::vector<cv::KeyPoint>& keypoints, const cv::Mat& descriptors,
               const CameraIntrinsics& camera)
{
  if (std::size_t(descriptors.rows) != keypoints.size())
    throw BadArgumentException("makeFeatures: " + std::to_string(descriptors.rows) +
                               " descriptors of " + std::to_string(keypoints.size()) +
                               " keypoints");
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const Eigen::Vector2d pixel(keypoints[i].pt.x, keypoints[i].pt.y);
    if (!pixel.allFinite() || !camera.contains(pixel))
      throw BadArgumentException("makeFeatures: keypoint " + std::to_string(i) +
                                 " lies outside the image");
  }
}

/** A recording's features stay in memory: no more than they need. */
void
reserve(std::size_t count, Features& features)
{
  features.pixels.reserve(count);
  features.pixel_sigmas.reserve(count);
  features.colors.reserve(count);
  features.depths.reserve(count);
  features.depth_sigmas.reserve(count);
  features.depth_slopes.reserve(count);
}

void
add(const cv::KeyPoint& keypoint, const RGBDFrame& frame, const CameraIntrinsics& camera,
    const FeatureOptions& options, Features& features)
{
  features.pixels.emplace_back(keypoint.pt.x, keypoint.pt.y);
  // A keypoint of a coarser octave is localised less well, in proportion to its size
  // (about 2 px at the finest scale that SIFT detects).
  features.pixel_sigmas.push_back(options.pixel_sigma *
                                  std::max(1.0f, std::sqrt(keypoint.size / 4)));
  features.colors.push_back(frame.color.at<cv::Vec3b>(keypoint.pt));
  const MeasuredDepth measured = measureDepth(frame.depth, camera, features.pixels.back(), options);
  features.depths.push_back(measured.depth);
  features.depth_sigmas.push_back(measured.sigma);
  features.depth_slopes.push_back(measured.slope);
}

} // namespace

Features
makeFeatures(const std::vector<cv::KeyPoint>& keypoints, const cv::Mat& descriptors,
             const RGBDFrame& frame, const CameraIntrinsics& camera, const FeatureOptions& options)
{
  checkFeatureArguments("makeFeatures", frame, camera, options);
  checkKeypoints(keypoints, descriptors, camera);
  cv::Mat gray;
  cv::cvtColor(frame.color, gray, cv::COLOR_BGR2GRAY);
  Features features;
  features.sharpness = measureSharpness(gray);
  reserve(keypoints.size(), features);
  features.descriptors.create(descriptors.rows, descriptors.cols, descriptors.type());
  for (const int i : canonicalOrder(keypoints)) {
    descriptors.row(i).copyTo(features.descriptors.row(int(features.size())));
    add(keypoints[i], frame, camera, options, features);
  }
  if (const std::string fault = faultOf(features, camera); !fault.empty())
    throw BadArgumentException("makeFeatures: " + fault);
  return features;
}

} // namespace bundle_icp
