// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/features.h>

#include <bundle_icp/common/exceptions.h>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace bundle_icp {
namespace {

constexpr int DESCRIPTOR_SIZE = 128;
/** A window holds a depth edge when a depth is farther from the window's plane than this many
 *  sigma. The plane has explained the slope, and the largest of dozens of residuals is tested. */
constexpr double EDGE_SIGMAS = 8;

/** RootSIFT: the Hellinger kernel on SIFT as a Euclidean distance. */
void
toRootSift(const float* sift, std::uint8_t* root)
{
  const float sum = std::accumulate(sift, sift + DESCRIPTOR_SIZE, 1e-6f);
  for (int k = 0; k < DESCRIPTOR_SIZE; ++k)
    root[k] = std::uint8_t(std::min(127.0f, std::sqrt(sift[k] / sum) * 256.0f + 0.5f));
}

/** SIFT's own order depends on its threads: features are sorted by what they are. */
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
  return {z, float(std::hypot(sigma, slope)), plane.head<2>()};
}

/** The factor by which an image is reduced: options.image_reduction, or less for a small image. */
int
imageReduction(const cv::Size& size, const FeatureOptions& options)
{
  constexpr int smallest_side = 240; // [px]; below it the coarser octaves are empty
  return std::clamp(std::min(size.width, size.height) / smallest_side, 1, options.image_reduction);
}

/** Where a keypoint's window can have a depth, at the size of the reduced image. */
cv::Mat
depthMask(const cv::Mat& depth, const cv::Size& size, const FeatureOptions& options)
{
  cv::Mat share, mask;
  const int window = 2 * options.depth_radius + 1;
  cv::boxFilter((depth > 0) / 255, share, CV_32F, {window, window});
  cv::resize(share, mask, size, 0, 0, cv::INTER_AREA);
  return mask >= 0.4; // half of the window is asked for; the mask itself is off by half a pixel
}

/** SIFT with positions and sizes in pixels of `gray`, of keypoints that can have a depth. */
void
detectSift(const cv::Mat& gray, const cv::Mat& depth, const FeatureOptions& options,
           std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors)
{
  const int reduction = imageReduction(gray.size(), options);
  cv::Mat image = gray;
  if (reduction > 1)
    cv::resize(gray, image, gray.size() / reduction, 0, 0, cv::INTER_AREA);
  cv::SIFT::create(options.max_features, 3, options.contrast_threshold)
      ->detectAndCompute(image, depthMask(depth, image.size(), options), keypoints, descriptors);
  // SIFT doubles its image by cv::resize, whose first pixel lies a quarter of a pixel before that
  // of the image, and halves positions as if it did not; that of the reduced image lies (reduction
  // - 1) / 2 behind that of `gray`.
  const float scale_x = float(gray.cols) / image.cols, scale_y = float(gray.rows) / image.rows;
  for (cv::KeyPoint& keypoint : keypoints) {
    keypoint.pt.x = scale_x * (keypoint.pt.x - 0.25f + 0.5f) - 0.5f;
    keypoint.pt.y = scale_y * (keypoint.pt.y - 0.25f + 0.5f) - 0.5f;
    keypoint.size *= scale_x;
  }
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
checkArguments(const RGBDFrame& frame, const CameraIntrinsics& camera,
               const FeatureOptions& options)
{
  std::string error;
  if (!options.isValid(&error) || !camera.isValid(&error))
    throw BadArgumentException("extractFeatures: " + error);
  const cv::Size size(camera.width, camera.height);
  if (frame.color.type() != CV_8UC3 || frame.depth.type() != CV_32FC1 ||
      frame.color.size() != size || frame.depth.size() != size)
    throw BadArgumentException("extractFeatures: frame " + std::to_string(frame.id) +
                               " needs CV_8UC3 colour and CV_32FC1 depth of the camera's size");
}

} // namespace

bool
FeatureOptions::isValid(std::string* error) const
{
  std::string reason;
  if (max_features < 3)
    reason = "max_features must be >= 3";
  else if (!(contrast_threshold >= 0 && contrast_threshold < 1))
    reason = "contrast_threshold must lie in [0, 1)";
  else if (image_reduction < 1)
    reason = "image_reduction must be >= 1";
  else if (depth_radius < 1)
    reason = "depth_radius must be >= 1 px";
  else if (!(pixel_sigma > 0))
    reason = "pixel_sigma must be > 0";
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

Features
extractFeatures(const RGBDFrame& frame, const CameraIntrinsics& camera,
                const FeatureOptions& options)
{
  checkArguments(frame, camera, options);
  cv::Mat gray, sift_descriptors;
  cv::cvtColor(frame.color, gray, cv::COLOR_BGR2GRAY);
  std::vector<cv::KeyPoint> keypoints;
  detectSift(gray, frame.depth, options, keypoints, sift_descriptors);

  Features features;
  features.sharpness = measureSharpness(gray);
  features.descriptors.create(int(keypoints.size()), DESCRIPTOR_SIZE, CV_8UC1);
  for (const int i : canonicalOrder(keypoints)) {
    const cv::KeyPoint& keypoint = keypoints[i];
    const int row = int(features.size());
    toRootSift(sift_descriptors.ptr<float>(i), features.descriptors.ptr<std::uint8_t>(row));
    features.pixels.emplace_back(keypoint.pt.x, keypoint.pt.y);
    // A keypoint of a coarser octave is localised less well, in proportion to its size
    // (about 2 px at the finest scale that SIFT detects).
    features.pixel_sigmas.push_back(options.pixel_sigma *
                                    std::max(1.0f, std::sqrt(keypoint.size / 4)));
    features.colors.push_back(frame.color.at<cv::Vec3b>(keypoint.pt));
    const MeasuredDepth measured =
        measureDepth(frame.depth, camera, features.pixels.back(), options);
    features.depths.push_back(measured.depth);
    features.depth_sigmas.push_back(measured.sigma);
    features.depth_slopes.push_back(measured.slope);
  }
  return features;
}

} // namespace bundle_icp
