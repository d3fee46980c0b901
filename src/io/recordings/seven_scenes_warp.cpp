// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/seven_scenes_warp.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace bundle_icp {

namespace {

constexpr double DEPTH_FOCAL = 585, CENTER_X = 320, CENTER_Y = 240; // [px]

// Fitted so that the occlusion edges of the depth fall on colour gradients: over parts
// of redkitchen the best focal length varies from 526 to 527 px, the shift from -1.75
// to -2.5 px, and the baseline from -25 to -29 mm against a horizontal shift of 0
// to 1.5 px.
constexpr double COLOR_FOCAL = 526.5; // [px]
constexpr double BASELINE = -0.025;   // [m]
constexpr double SHIFT_Y = -2;        // [px]

constexpr std::uint16_t DEFAULT_DEPTH = 2000; // [mm], for an image without any depth

bool
isMeasured(std::uint16_t depth)
{
  return depth != 0 && depth != 65535;
}

// One depth per 4 x 4 pixels: the measured one nearest to the cell. Holes are smooth
// enough that this is as good as filling every pixel, at a sixteenth of the cost.
cv::Mat
fillCoarsely(const cv::Mat& depth)
{
  const cv::Size size((depth.cols + 3) / 4, (depth.rows + 3) / 4);
  cv::Mat coarse(size, CV_16UC1), hole(size, CV_8UC1);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      std::uint16_t found = 0;
      for (int v = 4 * y; v < std::min(4 * y + 4, depth.rows) && found == 0; ++v)
        for (int u = 4 * x; u < std::min(4 * x + 4, depth.cols) && found == 0; ++u)
          if (isMeasured(depth.at<std::uint16_t>(v, u)))
            found = depth.at<std::uint16_t>(v, u);
      coarse.at<std::uint16_t>(y, x) = found;
      hole.at<std::uint8_t>(y, x) = found == 0;
    }

  cv::Mat distance, label;
  cv::distanceTransform(hole, distance, label, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
  std::vector<std::uint16_t> depth_of_label(size.area() + 1, DEFAULT_DEPTH);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      if (!hole.at<std::uint8_t>(y, x))
        depth_of_label[label.at<int>(y, x)] = coarse.at<std::uint16_t>(y, x);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      if (hole.at<std::uint8_t>(y, x))
        coarse.at<std::uint16_t>(y, x) = depth_of_label[label.at<int>(y, x)];
  return coarse;
}

cv::Mat
fillHoles(const cv::Mat& depth)
{
  const cv::Mat coarse = fillCoarsely(depth);
  cv::Mat filled(depth.size(), CV_16UC1);
  for (int y = 0; y < depth.rows; ++y) {
    const std::uint16_t* const in = depth.ptr<std::uint16_t>(y);
    const std::uint16_t* const fill = coarse.ptr<std::uint16_t>(y / 4);
    std::uint16_t* const out = filled.ptr<std::uint16_t>(y);
    for (int x = 0; x < depth.cols; ++x)
      out[x] = isMeasured(in[x]) ? in[x] : fill[x / 4];
  }
  // Single pixels of wrong depth at edges would tear the colour.
  cv::Mat smooth;
  cv::medianBlur(filled, smooth, 5);
  return smooth;
}

} // namespace

bool
isSevenScenesDepthCamera(const CameraIntrinsics& camera)
{
  return camera.width == 640 && camera.height == 480 && std::abs(camera.fx - DEPTH_FOCAL) < 1 &&
         std::abs(camera.fy - DEPTH_FOCAL) < 1 && std::abs(camera.cx - CENTER_X) < 1 &&
         std::abs(camera.cy - CENTER_Y) < 1 && !camera.hasDistortion();
}

cv::Mat
warpSevenScenesColor(const cv::Mat& color, const cv::Mat& depth)
{
  const cv::Mat filled = fillHoles(depth);
  const double zoom = COLOR_FOCAL / DEPTH_FOCAL;
  const float parallax = float(COLOR_FOCAL * BASELINE * 1000); // [px mm]
  cv::Mat map_x(depth.size(), CV_32FC1), map_y(depth.size(), CV_32FC1);
  for (int y = 0; y < depth.rows; ++y) {
    map_y.row(y).setTo(zoom * (y - CENTER_Y) + CENTER_Y + SHIFT_Y);
    const std::uint16_t* const z = filled.ptr<std::uint16_t>(y);
    float* const out = map_x.ptr<float>(y);
    for (int x = 0; x < depth.cols; ++x)
      out[x] = float(zoom * (x - CENTER_X) + CENTER_X) + parallax / z[x];
  }
  cv::Mat warped;
  cv::remap(color, warped, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return warped;
}

} // namespace bundle_icp
