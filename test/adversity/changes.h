// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "recording.h"

#include <opencv2/imgproc.hpp>

#include <functional>

/** Changes that several inputs share. Pixels of base recordings are shared: changes replace them.
 */
namespace adversity {

using PixelChange = std::function<cv::Mat(std::size_t index, const cv::Mat& pixels)>;

inline void
changePixels(std::vector<Image>& images, const PixelChange& change)
{
  for (std::size_t i = 0; i < images.size(); ++i)
    images[i].pixels = change(i, images[i].pixels);
}

/** Metres to units by any rule; 0 stays 0. */
inline void
changeDepth(Recording& recording, const std::function<double(double metres)>& units)
{
  changePixels(recording.depth, [&](std::size_t, const cv::Mat& pixels) {
    cv::Mat changed = pixels.clone();
    for (int y = 0; y < changed.rows; ++y)
      for (int x = 0; x < changed.cols; ++x)
        if (ushort& value = changed.at<ushort>(y, x); value != 0)
          value = cv::saturate_cast<ushort>(units(value / recording.depth_scale));
    return changed;
  });
}

/** Open3D's layout, with depth in millimetres. */
inline void
toOpen3d(Recording& recording)
{
  changeDepth(recording, [](double metres) { return 1000 * metres; });
  recording.layout = Layout::OPEN3D;
  recording.depth_scale = 1000;
}

/** Gives each image of a stream its name. */
inline void
rename(std::vector<Image>& images, const std::function<std::string(std::size_t)>& name)
{
  for (std::size_t i = 0; i < images.size(); ++i)
    images[i].name = name(i);
}

/** Times of both streams by a rule. */
inline void
changeTimes(Recording& recording, const std::function<double(std::size_t, double)>& time)
{
  for (std::vector<Image>* images : {&recording.color, &recording.depth})
    for (std::size_t i = 0; i < images->size(); ++i)
      (*images)[i].time = time(i, (*images)[i].time);
}

/** Frame i keeps its colour and gets what depth image i + `frames` shows, where there is one. */
inline void
shiftDepth(Recording& recording, int frames)
{
  const std::vector<Image> color = recording.color, depth = recording.depth;
  recording.color.clear();
  recording.depth.clear();
  for (int i = 0; i < int(color.size()); ++i)
    if (i + frames >= 0 && i + frames < int(depth.size())) {
      recording.color.push_back(color[std::size_t(i)]);
      recording.depth.push_back(depth[std::size_t(i)]);
      recording.depth.back().pixels = depth[std::size_t(i + frames)].pixels;
    }
}

inline Recording
everyNth(Recording recording, std::size_t step)
{
  for (std::vector<Image>* images : {&recording.color, &recording.depth}) {
    std::vector<Image> kept;
    for (std::size_t i = 0; i < images->size(); i += step)
      kept.push_back((*images)[i]);
    *images = kept;
  }
  return recording;
}

/** Moves the content of an image and fills what comes in with 0. */
inline cv::Mat
moved(const cv::Mat& pixels, double zoom, double dx, double dy)
{
  const double cx = 0.5 * pixels.cols, cy = 0.5 * pixels.rows;
  const cv::Matx23d affine(zoom, 0, cx - zoom * cx + dx, 0, zoom, cy - zoom * cy + dy);
  cv::Mat result;
  cv::warpAffine(pixels, result, affine, pixels.size(), cv::INTER_NEAREST);
  return result;
}

/** Another image of the same view, as a second capture or encoder makes it; depth that is absent
 *  stays so. */
inline cv::Mat
withNoise(const cv::Mat& pixels, double deviation, std::size_t seed)
{
  cv::Mat noise(pixels.size(), CV_MAKETYPE(CV_16S, pixels.channels())), sum, result;
  cv::RNG random(seed + 77);
  random.fill(noise, cv::RNG::NORMAL, 0, deviation);
  cv::Mat wide;
  pixels.convertTo(wide, CV_32F);
  noise.convertTo(noise, CV_32F);
  sum = wide + noise;
  sum.convertTo(result, pixels.depth());
  if (pixels.channels() == 1)
    result.setTo(0, pixels == 0);
  return result;
}

} // namespace adversity
