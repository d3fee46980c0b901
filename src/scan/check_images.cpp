// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/check_images.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cstring>
#include <vector>

namespace bundle_icp {
namespace {

/** A jump of depth by this share is an edge of a body, not a slope or noise. */
constexpr float JUMP = 0.06f;
/** Share of the pixels that must be edges to say something. */
constexpr double FEWEST_EDGES = 0.005;
/** Agreement of two images of edges from which they say the same. */
constexpr double SAME_VIEW = 0.4;

/** Jumps between neighbours that both have depth, and between the nearest depths around holes. */
cv::Mat
depthEdges(const cv::Mat& small)
{
  cv::Mat edges(small.size(), CV_32FC1, cv::Scalar(0));
  int count = 0;
  for (int y = 0; y + 2 < small.rows; ++y)
    for (int x = 0; x + 2 < small.cols; ++x)
      for (const cv::Point step : {cv::Point(2, 0), cv::Point(0, 2)}) {
        const float a = small.at<float>(y, x), b = small.at<float>(y + step.y, x + step.x);
        if (std::abs(a - b) > JUMP * std::min(a, b)) { // false without depth
          edges.at<float>(y + step.y / 2, x + step.x / 2) = 1;
          ++count;
        }
      }
  if (count < FEWEST_EDGES * double(small.total()))
    return {};
  cv::GaussianBlur(edges, edges, {}, 1.0);
  return normalised(edges);
}

/** Magnitude of the gradient relative to what is usual around. */
cv::Mat
colorEdges(const cv::Mat& small)
{
  cv::Mat dx, dy, magnitude, usual;
  cv::Sobel(small, dx, CV_32F, 1, 0);
  cv::Sobel(small, dy, CV_32F, 0, 1);
  cv::magnitude(dx, dy, magnitude);
  cv::GaussianBlur(magnitude, magnitude, {}, 1.0);
  cv::GaussianBlur(magnitude, usual, {}, 12.0);
  return normalised(magnitude / (usual + 4));
}

void
lookAtDepth(const cv::Mat& depth, FrameLook& look)
{
  std::vector<float> depths;
  for (int y = 0; y < depth.rows; y += 2)
    for (int x = 0; x < depth.cols; x += 2)
      if (const float z = depth.at<float>(y, x); z > 0)
        depths.push_back(z);
  look.measured = double(depths.size()) / (((depth.rows + 1) / 2) * ((depth.cols + 1) / 2));
  if (depths.empty())
    return;
  const auto quantile = [&depths](std::size_t percent) {
    const auto place = depths.begin() + std::ptrdiff_t(depths.size() * percent / 100);
    std::nth_element(depths.begin(), place, depths.end());
    return double(*place);
  };
  look.median_depth = quantile(50);
  look.near_depth = quantile(10);
  look.far_depth = quantile(90);
}

bool
hasEdges(const FrameLook& look)
{
  return !look.depth_edges.empty() && !look.color_edges.empty();
}

} // namespace

std::uint64_t
hashOf(const cv::Mat& image)
{
  std::uint64_t hash = 14695981039346656037u; // FNV-1a, by words of 32 bits where they fill a row
  const std::size_t bytes = std::size_t(image.cols) * image.elemSize();
  for (int y = 0; y < image.rows; ++y)
    for (std::size_t x = 0; x < bytes; x += sizeof(std::uint32_t)) {
      std::uint32_t word = 0;
      std::memcpy(&word, image.ptr(y) + x, std::min(sizeof(word), bytes - x));
      hash = (hash ^ word) * 1099511628211u;
    }
  return hash;
}

cv::Mat
normalised(const cv::Mat& image)
{
  cv::Mat result = image - cv::mean(image)[0];
  const double norm = cv::norm(result);
  return norm > 1e-9 ? cv::Mat(result / norm) : cv::Mat();
}

FrameLook
lookAt(const RGBDFrame& frame, const CameraIntrinsics& camera)
{
  FrameLook look;
  look.is_read = true;
  cv::Mat grey;
  cv::cvtColor(frame.color, grey, cv::COLOR_BGR2GRAY);
  cv::Scalar mean, deviation;
  cv::meanStdDev(grey, mean, deviation);
  look.brightness = mean[0];
  look.contrast = deviation[0];
  cv::Mat laplacian;
  cv::Laplacian(grey, laplacian, CV_32F);
  cv::meanStdDev(laplacian, mean, deviation);
  look.sharpness = deviation[0] / std::max(1.0, look.contrast);
  look.color_hash = hashOf(frame.color);
  look.depth_hash = hashOf(frame.depth);
  lookAtDepth(frame.depth, look);
  look.numbers = numbersOf(frame.depth, camera);
  const double scale = std::min(1.0, double(EDGE_WIDTH) / frame.color.cols);
  const cv::Size size(std::max(3, int(frame.color.cols * scale)),
                      std::max(3, int(frame.color.rows * scale)));
  cv::resize(grey, grey, size, 0, 0, cv::INTER_AREA);
  grey.convertTo(look.small_grey, CV_32F);
  cv::Mat small_depth;
  cv::resize(frame.depth, small_depth, size, 0, 0, cv::INTER_NEAREST);
  look.depth_edges = depthEdges(small_depth);
  look.color_edges = colorEdges(look.small_grey);
  return look;
}

std::vector<FrameLook>
withDifferentEdges(const FrameSample& sample)
{
  std::vector<FrameLook> views;
  for (const FrameLook& look : sample.looks)
    if (hasEdges(look) && std::none_of(views.begin(), views.end(), [&look](const FrameLook& view) {
          return look.color_edges.dot(view.color_edges) > SAME_VIEW;
        }))
      views.push_back(look);
  return views;
}

double
shareOfDifferentViews(const FrameSample& sample)
{
  const auto all = std::count_if(sample.looks.begin(), sample.looks.end(), hasEdges);
  return all == 0 ? 1 : double(withDifferentEdges(sample).size()) / double(all);
}

double
agreement(const FrameLook& depth, const FrameLook& color, const cv::Point& shift)
{
  if (depth.depth_edges.empty() || color.color_edges.empty())
    return 0;
  const cv::Rect image({0, 0}, depth.depth_edges.size());
  const cv::Rect target = image & (image + shift);
  return depth.depth_edges(target - shift).dot(color.color_edges(target));
}

} // namespace bundle_icp
