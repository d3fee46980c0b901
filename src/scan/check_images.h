// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/depth_numbers.h"

#include <bundle_icp/common/rgbd_frame.h>

namespace bundle_icp {

/** Width of the images of edges [px]: a pixel of them forgives a registration of a few pixels. */
constexpr int EDGE_WIDTH = 160;

/** What checkRecording() keeps of a frame. */
struct FrameLook {
  bool is_read = false;
  double brightness = 0;   ///< mean grey level of 255
  double contrast = 0;     ///< standard deviation of the grey levels of 255
  double sharpness = 0;    ///< mean square of the differences of neighbours, over the contrast's
  double measured = 0;     ///< share of the pixels that have depth
  double median_depth = 0; ///< [m]; 0 without depth
  double near_depth = 0;   ///< a tenth of the depth is nearer [m]; 0 without depth
  double far_depth = 0;    ///< a tenth of the depth is farther [m]; 0 without depth
  DepthNumbers numbers;
  cv::Mat depth_edges; ///< CV_32FC1, small: where the depth jumps, mean 0, norm 1 or empty
  cv::Mat color_edges; ///< CV_32FC1, of the same size, mean 0, norm 1 or empty
  cv::Mat small_grey;  ///< CV_32FC1, of the same size
  std::uint64_t color_hash = 0, depth_hash = 0; ///< of all bytes
};

/** The frames that were looked at, in runs of neighbours. */
struct FrameSample {
  std::vector<std::size_t> order;  ///< all frames of the recording in the order of time
  std::vector<std::size_t> places; ///< those of the sample in that order
  std::vector<std::size_t> frames; ///< their indices
  std::size_t step = 1;            ///< between the places of a run
  std::vector<FrameLook> looks;
  double pixels_per_edge_pixel = 1; ///< width of the images over that of the images of edges
};

/** Of all bytes of an image. */
std::uint64_t
hashOf(const cv::Mat& image);

FrameLook
lookAt(const RGBDFrame& frame, const CameraIntrinsics& camera);

/** Mean 0 and norm 1; empty when nothing differs. */
cv::Mat
normalised(const cv::Mat& image);

/** Frames with edges in colour and depth that differ from each other: a camera that stands still or
 *  comes back shows one view, however many frames it takes. */
std::vector<FrameLook>
withDifferentEdges(const FrameSample& sample);

/** Share of them in all frames with edges; 1 where there are none. */
double
shareOfDifferentViews(const FrameSample& sample);

/** How well depth edges, moved by `shift`, lie on colour edges, -1 to 1; 0 when either is empty. */
double
agreement(const FrameLook& depth, const FrameLook& color, const cv::Point& shift = {});

} // namespace bundle_icp
