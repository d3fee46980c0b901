// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/features.h>

#include "graph/feature_checks.h"

#include <bundle_icp/graph/own_features.h>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bundle_icp {
namespace {

/** RootSIFT: the Hellinger kernel on SIFT as a Euclidean distance. */
void
toRootSift(const float* sift, std::uint8_t* root)
{
  const float sum = std::accumulate(sift, sift + DESCRIPTOR_SIZE, 1e-6f);
  for (int k = 0; k < DESCRIPTOR_SIZE; ++k)
    root[k] = std::uint8_t(
        std::min(float(LARGEST_IN_DESCRIPTOR), std::sqrt(sift[k] / sum) * 256.0f + 0.5f));
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
  checkFeatureArguments("extractFeatures", frame, camera, options);
  cv::Mat gray, sift;
  cv::cvtColor(frame.color, gray, cv::COLOR_BGR2GRAY);
  std::vector<cv::KeyPoint> keypoints;
  detectSift(gray, frame.depth, options, keypoints, sift);
  cv::Mat descriptors(int(keypoints.size()), DESCRIPTOR_SIZE, CV_8UC1);
  for (int i = 0; i < descriptors.rows; ++i)
    toRootSift(sift.ptr<float>(i), descriptors.ptr<std::uint8_t>(i));
  return makeFeatures(keypoints, descriptors, frame, camera, options);
}

} // namespace bundle_icp
