// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/camera_fixed.h"

#include "common/parallel.h"

#include <opencv2/imgproc.hpp>
#include <pcl/exceptions.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace bundle_icp {
namespace {

/** Frames are looked at in cells of so many pixels. */
constexpr int CELL = 4;
/** Fewer frames do not show what stays. */
constexpr std::size_t MIN_SAMPLES = 8;
/** A cell stays when its depth is the same in this share of the frames. */
constexpr double STAYS = 0.85;
/** Beside cells that stay, those count as well that are measured in fewer frames, but at least in
 *  this share: the sensor sees little of steep sides. */
constexpr double SELDOM_MEASURED = 0.25;
/** Depth is the same within so many standard deviations of the sensor. */
constexpr double SAME_SIGMAS = 4;
/** Smallest share of the image that counts. */
constexpr double MIN_SHARE = 0.005;
/** Share of a region's border at which depth must break off. */
constexpr double MIN_EDGE = 0.6;

/** Depth of every CELL-th pixel; empty when the frame cannot be read. */
std::vector<cv::Mat>
sampleDepth(const RGBDDataset& dataset, int num_threads, std::size_t num_samples)
{
  const std::size_t count = std::min(num_samples, dataset.size());
  std::vector<cv::Mat> samples(count);
  parallelFor(count, num_threads, {}, [&](std::size_t k) {
    try {
      const cv::Mat depth = dataset.read(k * dataset.size() / count).depth;
      cv::resize(depth, samples[k], {depth.cols / CELL, depth.rows / CELL}, 0, 0,
                 cv::INTER_NEAREST);
    }
    catch (const pcl::IOException&) { // the frame's own report says so
    }
  });
  samples.erase(std::remove_if(samples.begin(), samples.end(),
                               [](const cv::Mat& sample) { return sample.empty(); }),
                samples.end());
  return samples;
}

bool
isSame(float a, float b, const DepthNoise& noise)
{
  return std::abs(a - b) <= SAME_SIGMAS * std::sqrt(2.0) * noise.sigma(std::max(a, b));
}

/** Median depth of each cell that stays at it in most of the frames that measure it, 0 elsewhere.
 *  \param measured share of all frames that must measure it there */
cv::Mat
constantDepth(const std::vector<cv::Mat>& samples, const DepthNoise& noise, double measured)
{
  cv::Mat constant(samples.front().size(), CV_32FC1, cv::Scalar(0));
  std::vector<float> values;
  for (int y = 0; y < constant.rows; ++y)
    for (int x = 0; x < constant.cols; ++x) {
      values.clear();
      for (const cv::Mat& sample : samples)
        if (sample.at<float>(y, x) > 0)
          values.push_back(sample.at<float>(y, x));
      const double needed =
          std::max(STAYS * double(values.size()), measured * double(samples.size()));
      if (double(values.size()) < needed)
        continue;
      const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
      std::nth_element(values.begin(), middle, values.end());
      const float median = *middle;
      const auto same = std::count_if(values.begin(), values.end(),
                                      [&](float z) { return isSame(z, median, noise); });
      if (double(same) >= needed)
        constant.at<float>(y, x) = median;
    }
  return constant;
}

/** Share of the border of region `label`, within the image, beyond which depth is elsewhere in most
 *  frames. Two cells out: the cell at an edge mixes both sides. */
double
edgeShare(const cv::Mat& labels, int label, const cv::Mat& constant,
          const std::vector<cv::Mat>& samples, const DepthNoise& noise)
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
        for (const cv::Mat& sample : samples)
          if (const float z = sample.at<float>(beyond); z > 0) {
            ++measured;
            apart += !isSame(z, constant.at<float>(y, x), noise) &&
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

CameraFixed
findCameraFixed(const RGBDDataset& dataset, int num_threads, std::size_t num_samples)
{
  CameraFixed found;
  const std::vector<cv::Mat> samples = sampleDepth(dataset, num_threads, num_samples);
  if (samples.size() < MIN_SAMPLES)
    return found;
  const DepthNoise& noise = dataset.camera().depth_noise;
  const cv::Mat constant = constantDepth(samples, noise, STAYS);
  cv::Mat measured(constant.size(), CV_8UC1, cv::Scalar(0));
  for (const cv::Mat& sample : samples)
    measured |= sample > 0;
  cv::Mat stays = constant > 0;
  found.share = double(cv::countNonZero(stays)) / std::max(1, cv::countNonZero(measured));
  if (found.share == 0 || found.share > 0.5)
    return found;
  // Holes of the sensor are closed, single cells are chance.
  const cv::Mat kernel = cv::getStructuringElement(cv::MORPH_RECT, {5, 5});
  cv::morphologyEx(stays, stays, cv::MORPH_CLOSE, kernel);
  cv::morphologyEx(stays, stays, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
  cv::Mat labels, statistics, centers;
  const int count = cv::connectedComponentsWithStats(stays, labels, statistics, centers, 4);
  cv::Mat mask(stays.size(), CV_8UC1, cv::Scalar(0));
  for (int label = 1; label < count; ++label)
    if (statistics.at<int>(label, cv::CC_STAT_AREA) >= MIN_SHARE * double(mask.total()) &&
        edgeShare(labels, label, constant, samples, noise) >= MIN_EDGE)
      mask |= labels == label;
  if (cv::countNonZero(mask) == 0)
    return found;
  growInto(mask, constantDepth(samples, noise, SELDOM_MEASURED) > 0);
  cv::dilate(mask, mask, kernel); // mixed pixels at its edge
  cv::resize(mask, found.mask, {dataset.camera().width, dataset.camera().height}, 0, 0,
             cv::INTER_NEAREST);
  return found;
}

} // namespace bundle_icp
