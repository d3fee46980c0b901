// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/component_bridges.h"

#include "scan/read_in_order.h"

#include <opencv2/imgproc.hpp>
#include <pcl/exceptions.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace bundle_icp {
namespace {

/** How much two frames are like each other; larger is more. */
using Likeness = double;
constexpr Likeness UNLIKE = -std::numeric_limits<Likeness>::infinity();

/** Small images without brightness and contrast, by frame; empty for frames without a component. */
std::vector<cv::Mat>
smallImages(const RGBDDataset& dataset, const ReconstructionResult& result, int num_threads)
{
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < result.frames.size(); ++i)
    if (result.frames[i].registered)
      indices.push_back(i);
  std::vector<cv::Mat> images(result.frames.size());
  readInOrder(dataset, indices, num_threads,
              [&](std::size_t index, const RGBDFrame& frame, const std::string& error) {
                if (!error.empty())
                  return true;
                cv::Mat gray, small;
                cv::cvtColor(frame.color, gray, cv::COLOR_BGR2GRAY);
                cv::resize(gray, small, {16, 12}, 0, 0, cv::INTER_AREA);
                small.convertTo(small, CV_32F);
                small -= cv::mean(small);
                small /= std::max(cv::norm(small), 1e-6);
                images[index] = small;
                return true;
              });
  return images;
}

/** The frames of component 0 and of another one that `likeness` says are most alike. */
template <typename Function>
bool
chooseFrames(const ReconstructionResult& result, const Function& likeness, NextView& view)
{
  Likeness most = UNLIKE;
  for (std::size_t i = 0; i < result.frames.size(); ++i)
    for (std::size_t j = 0; j < result.frames.size(); ++j)
      if (result.frames[i].component == 0 && result.frames[j].component == view.component)
        if (const Likeness like = likeness(i, j); like > most) {
          most = like;
          view.nearest_frame = i;
          view.other_frame = j;
        }
  return most > UNLIKE;
}

/** The frames with the most matches, if any have. */
bool
chooseByMatches(const ReconstructionResult& result, NextView& view)
{
  std::size_t most = 0;
  for (std::size_t node = 0; node < result.frame_of_node.size(); ++node) {
    const std::size_t frame = result.frame_of_node[node];
    if (result.frames[frame].component != view.component)
      continue;
    for (const ImageEdge& edge : result.graph->edges(node)) {
      const std::size_t neighbour = result.frame_of_node[edge.neighbour];
      if (result.frames[neighbour].component == 0 && edge.pair->matches.size() > most) {
        most = edge.pair->matches.size();
        view.nearest_frame = neighbour;
        view.other_frame = frame;
      }
    }
  }
  return most > 0;
}

} // namespace

std::vector<NextView>
bridgeComponents(const RGBDDataset& dataset, const ReconstructionResult& result,
                 std::size_t max_views, int num_threads)
{
  std::vector<NextView> views;
  std::vector<cv::Mat> images;
  const bool has_times = dataset.isOrdered() && dataset.hasTimes();
  const auto byTime = [&](std::size_t i, std::size_t j) {
    return -std::abs(result.frames[i].timestamp - result.frames[j].timestamp);
  };
  const auto byImage = [&](std::size_t i, std::size_t j) {
    return images[i].empty() || images[j].empty() ? UNLIKE : images[i].dot(images[j]);
  };
  for (std::size_t c = 1; c < result.component_sizes.size() && views.size() < max_views; ++c) {
    NextView view;
    view.purpose = NextViewPurpose::CONNECT_COMPONENT;
    view.component = int(c);
    bool is_found = chooseByMatches(result, view);
    if (!is_found && !has_times && images.empty())
      images = smallImages(dataset, result, num_threads);
    if (!is_found)
      is_found =
          has_times ? chooseFrames(result, byTime, view) : chooseFrames(result, byImage, view);
    if (!is_found)
      continue;
    view.world_from_camera = result.frames[view.nearest_frame].world_from_camera;
    views.push_back(view);
  }
  return views;
}

cv::Mat
drawFrames(const RGBDDataset& dataset, std::size_t left, std::size_t right, int width)
{
  const cv::Size size(width / 2, width / 2 * dataset.camera().height / dataset.camera().width);
  cv::Mat picture(size.height, width, CV_8UC3, cv::Scalar::all(128));
  for (const auto& [frame, x] : {std::pair{left, 0}, std::pair{right, width / 2}})
    try {
      cv::resize(dataset.read(frame).color, picture(cv::Rect({x, 0}, size)), size, 0, 0,
                 cv::INTER_AREA);
    }
    catch (const pcl::IOException&) { // one that could be read before
    }
  return picture;
}

} // namespace bundle_icp
