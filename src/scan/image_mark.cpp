// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/image_mark.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Fewer views do not tell a mark from chance. */
constexpr std::size_t MIN_VIEWS = 12;
/** Smallest gradient whose direction is no noise [grey levels per pixel]. */
constexpr float MIN_GRADIENT = 6;
/** Mean resultant length of directions (Mardia, Jupp, "Directional Statistics", 2.3): 1 where all
 *  are the same. Of 12 random ones it is above this in 3 of 1000 cases, of 24 in one of 100,000. */
constexpr float SAME_DIRECTION = 0.7f;
/** Mean cosine between the directions of two images of one view. */
constexpr double SAME_VIEW = 0.5;
/** A mark of fewer pixels misleads nobody. */
constexpr int SMALLEST_MARK = 12;
/** A mark covers less than this share of the image. */
constexpr double LARGEST_MARK = 0.5;
/** Pixels that are darker are no part of the picture: a border. */
constexpr int BLACK = 4;

/** Directions of the gradients of one colour channel, CV_32FC2: unit vectors, 0 where the gradient
 *  is small. */
cv::Mat
directions(const cv::Mat& channel)
{
  cv::Mat along_u, along_v, result(channel.size(), CV_32FC2);
  cv::Scharr(channel, along_u, CV_32F, 1, 0, 1 / 32.0);
  cv::Scharr(channel, along_v, CV_32F, 0, 1, 1 / 32.0);
  for (int y = 0; y < channel.rows; ++y)
    for (int x = 0; x < channel.cols; ++x) {
      const cv::Vec2f gradient(along_u.at<float>(y, x), along_v.at<float>(y, x));
      const float size = std::hypot(gradient[0], gradient[1]);
      result.at<cv::Vec2f>(y, x) = size < MIN_GRADIENT ? cv::Vec2f() : gradient / size;
    }
  return result;
}

/** A frame: directions of its gradients by channel, and its depth in cells. */
struct View {
  std::vector<cv::Mat> directions;
  cv::Mat depth;
};

View
viewOf(const FrameCells& frame)
{
  View view{{}, frame.depth};
  std::vector<cv::Mat> channels;
  cv::split(frame.color, channels);
  for (const cv::Mat& channel : channels)
    view.directions.push_back(directions(channel));
  return view;
}

/** Whether the camera rested between two frames: a mark alone makes gradients the same, but not
 *  depth. */
bool
isSameView(const View& a, const View& b, const DepthNoise& noise)
{
  double cosines = 0, edges = 0;
  for (std::size_t c = 0; c < a.directions.size(); ++c) {
    cosines += a.directions[c].dot(b.directions[c]);
    edges += a.directions[c].dot(a.directions[c]);
  }
  if (cosines < SAME_VIEW * edges)
    return false;
  std::size_t same = 0, measured = 0;
  for (int y = 0; y < a.depth.rows; ++y)
    for (int x = 0; x < a.depth.cols; ++x) {
      const float z = a.depth.at<float>(y, x), other = b.depth.at<float>(y, x);
      if (!(z > 0) || !(other > 0))
        continue;
      ++measured;
      same += isSameDepth(z, other, noise);
    }
  return measured > 0 && 2 * same >= measured;
}

/** Black frames, as sensors give at their start, show no view. */
bool
showsNothing(const View& view)
{
  return std::all_of(view.directions.begin(), view.directions.end(),
                     [](const cv::Mat& directions) { return cv::norm(directions) == 0; });
}

/** Of frames that show the same view, the first. */
std::vector<View>
differentViews(const std::vector<FrameCells>& frames, const DepthNoise& noise)
{
  std::vector<View> views;
  for (const FrameCells& frame : frames) {
    View view = viewOf(frame);
    if (!showsNothing(view) && std::none_of(views.begin(), views.end(), [&](const View& other) {
          return isSameView(other, view, noise);
        }))
      views.push_back(std::move(view));
  }
  return views;
}

/** Pixels whose gradient has the same direction in most views, in any channel. */
cv::Mat
constantDirections(const std::vector<View>& views)
{
  cv::Mat constant(views.front().directions.front().size(), CV_8UC1, cv::Scalar(0));
  for (std::size_t c = 0; c < views.front().directions.size(); ++c) {
    cv::Mat sum(constant.size(), CV_32FC2, cv::Scalar::all(0));
    for (const View& view : views)
      sum += view.directions[c];
    const float least = SAME_DIRECTION * float(views.size());
    for (int y = 0; y < sum.rows; ++y)
      for (int x = 0; x < sum.cols; ++x)
        if (cv::norm(sum.at<cv::Vec2f>(y, x)) >= double(least))
          constant.at<uchar>(y, x) = 255;
  }
  return constant;
}

/** Pixels at the border of what is black in all frames: images without distortion have one. */
cv::Mat
besideBlack(const std::vector<FrameCells>& frames)
{
  cv::Mat brightest = frames.front().color.clone(), gray, black;
  for (const FrameCells& frame : frames)
    brightest = cv::max(brightest, frame.color);
  cv::cvtColor(brightest, gray, cv::COLOR_BGR2GRAY);
  black = gray < BLACK;
  cv::dilate(black, black, square(7));
  return black;
}

} // namespace

cv::Mat
findImageMark(const std::vector<FrameCells>& frames, const CameraIntrinsics& camera)
{
  if (frames.size() < MIN_VIEWS)
    return {};
  const std::vector<View> views = differentViews(frames, camera.depth_noise);
  if (views.size() < MIN_VIEWS)
    return {};
  cv::Mat mark = constantDirections(views) & ~besideBlack(frames), labels, statistics, centers;
  cv::morphologyEx(mark, mark, cv::MORPH_CLOSE, square(3));
  const int count = cv::connectedComponentsWithStats(mark, labels, statistics, centers, 8);
  for (int label = 1; label < count; ++label)
    if (statistics.at<int>(label, cv::CC_STAT_AREA) < SMALLEST_MARK)
      mark.setTo(0, labels == label);
  // Features near a mark see it, too.
  cv::dilate(mark, mark, square(5));
  const double share = double(cv::countNonZero(mark)) / double(mark.total());
  if (share == 0 || share > LARGEST_MARK)
    return {};
  cv::Mat found;
  cv::resize(mark, found, {camera.width, camera.height}, 0, 0, cv::INTER_NEAREST);
  return found;
}

} // namespace bundle_icp
