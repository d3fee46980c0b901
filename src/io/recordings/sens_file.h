// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/dataset_formats.h"

namespace bundle_icp {

/** A frame of a .sens file, and where its images lie in the file. */
struct SensFrame {
  std::size_t begin = 0, color_size = 0, depth_size = 0; ///< [bytes]
  double stamp = 0;                                      ///< in the unit of the file
  Eigen::Matrix4d world_from_camera;
};

struct SensHeader {
  CameraIntrinsics color, depth;
  std::int32_t color_encoding = 0, depth_encoding = 0;
  double depth_scale = 1000;  ///< units per metre
  std::size_t num_frames = 0; ///< that the file should hold
};

/** What a .sens file holds apart from images: the frames that it holds whole. */
struct SensContent {
  SensHeader header;
  std::vector<SensFrame> frames;
};

/** Reads a .sens file of ScanNet, version 4, but no image.
 *  \throws pcl::IOException naming the file and what is wrong with it; no frame. */
SensContent
readSensContent(const std::string& path);

/** Reads the images of one frame.
 *  \param name names the frame in messages
 *  \throws pcl::IOException naming the frame and what is wrong with it. */
ImagePair
readSensImages(const std::string& path, const SensHeader& header, const SensFrame& frame,
               const std::string& name);

} // namespace bundle_icp
