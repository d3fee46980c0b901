// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/camera_fixed_part.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Beside cells that stay, those count as well that are measured in fewer frames, but at least in
 *  this share: the sensor sees little of steep sides. */
constexpr double SELDOM_MEASURED = 0.25;
/** Share of a region's border at which depth must break off. */
constexpr double MIN_EDGE = 0.6;

/** Median depth of each cell that stays at it in most of the frames that measure it, 0 elsewhere.
 *  \param measured share of all frames that must measure it there */
cv::Mat
constantDepth(const std::vector<FrameCells>& frames, const DepthNoise& noise, double measured)
{
  cv::Mat constant(frames.front().depth.size(), CV_32FC1, cv::Scalar(0));
  std::vector<float> values;
  for (int y = 0; y < constant.rows; ++y)
    for (int x = 0; x < constant.cols; ++x) {
      values.clear();
      for (const FrameCells& frame : frames)
        if (frame.depth.at<float>(y, x) > 0)
          values.push_back(frame.depth.at<float>(y, x));
      const double needed =
          std::max(STAYS * double(values.size()), measured * double(frames.size()));
      if (double(values.size()) < needed)
        continue;
      const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
      std::nth_element(values.begin(), middle, values.end());
      const float median = *middle;
      const auto same = std::count_if(values.begin(), values.end(),
                                      [&](float z) { return isSameDepth(z, median, noise); });
      if (double(same) >= needed)
        constant.at<float>(y, x) = median;
    }
  return constant;
}

/** Share of the border of region `label`, within the image, beyond which depth is elsewhere in most
 *  frames. Two cells out: the cell at an edge mixes both sides. */
double
edgeShare(const cv::Mat& labels, int label, const cv::Mat& constant,
          const std::vector<FrameCells>& frames, const DepthNoise& noise)
{
  std::size_t border = 0, edges = 0;
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < labels.cols; ++x) {
      if (labels.at<int>(y, x) != label)
        continue;
      for (const cv::Point step : {cv::Point(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
        const cv::Point next = cv::Point(x, y) + step, beyond = next + step;
        if (!cv::Rect({}, labels.size()).contains(beyond) || labels.at<int>(next) == label)
          continue;
        std::size_t apart = 0, measured = 0;
        for (const FrameCells& frame : frames)
          if (const float z = frame.depth.at<float>(beyond); z > 0) {
            ++measured;
            apart += !isSameDepth(z, constant.at<float>(y, x), noise) &&
                     std::abs(z - constant.at<float>(y, x)) > 0.05 * constant.at<float>(y, x);
          }
        ++border;
        edges += 2 * apart > measured;
      }
    }
  return border ? double(edges) / double(border) : 0;
}

/** Grows a mask into all of `allowed` that is connected with it. */
void
growInto(cv::Mat& mask, const cv::Mat& allowed)
{
  for (int before = 0, now = cv::countNonZero(mask); now > before;) {
    before = now;
    cv::Mat grown;
    cv::dilate(mask, grown, cv::Mat());
    mask |= grown & allowed;
    now = cv::countNonZero(mask);
  }
}

} // namespace

cv::Mat
findCameraFixedPart(const std::vector<FrameCells>& frames, const CameraIntrinsics& camera)
{
  cv::Mat found;
  const DepthNoise& noise = camera.depth_noise;
  const cv::Mat constant = constantDepth(frames, noise, STAYS);
  cv::Mat measured(constant.size(), CV_8UC1, cv::Scalar(0));
  for (const FrameCells& sample : frames)
    measured |= sample.depth > 0;
  cv::Mat stays = constant > 0;
  const double share_that_stays =
      double(cv::countNonZero(stays)) / std::max(1, cv::countNonZero(measured));
  if (share_that_stays == 0 || share_that_stays > 0.5)
    return found;
  // Holes of the sensor are closed, single cells are chance.
  cv::morphologyEx(stays, stays, cv::MORPH_CLOSE, square(5));
  cv::morphologyEx(stays, stays, cv::MORPH_OPEN, square(3));
  cv::Mat labels, statistics, centers;
  const int count = cv::connectedComponentsWithStats(stays, labels, statistics, centers, 4);
  cv::Mat mask(stays.size(), CV_8UC1, cv::Scalar(0));
  for (int label = 1; label < count; ++label)
    if (statistics.at<int>(label, cv::CC_STAT_AREA) >= SMALLEST_REGION * double(mask.total()) &&
        edgeShare(labels, label, constant, frames, noise) >= MIN_EDGE)
      mask |= labels == label;
  if (cv::countNonZero(mask) == 0)
    return found;
  growInto(mask, constantDepth(frames, noise, SELDOM_MEASURED) > 0);
  cv::dilate(mask, mask, square(5)); // mixed pixels at its edge
  cv::resize(mask, found, {camera.width, camera.height}, 0, 0, cv::INTER_NEAREST);
  return found;
}

} // namespace bundle_icp
