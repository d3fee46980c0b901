// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "common/depth_edges.h"

#include <bundle_icp/io/rgbd_dataset.h>

#include <opencv2/core/mat.hpp>

#include <vector>

namespace bundle_icp {

/** Pixel i of a depth image at depth z [m] lies at z * rays[i] + translation in homogeneous pixels
 *  of the colour camera. NaN where the lens model has no ray. */
struct DepthRays {
  std::vector<Eigen::Vector3f> rays; ///< row by row
  Eigen::Vector3f translation;
};

/** Moves depth images of a camera of their own into the pixels of the colour camera.
 *
 *  Neighbouring depth pixels on one surface span a mesh, which is rendered into the colour camera:
 *  it has no holes between them and bridges no depth edge. A pixel that the depth camera did not
 *  see, or that something nearer may hide, has no depth. */
class DepthRegistration {
public:
  /** \param depth the camera of the depth images, its size set; its distortion is removed
   *  \param color without distortion; its depth_noise tells noise from edges */
  DepthRegistration(const DepthCamera& depth, const CameraIntrinsics& color);

  /** \param depth CV_32FC1 [m] of the depth camera's size, NaN where nothing is measured
   *  \return CV_32FC1 [m] along the colour camera's axis, of its size, NaN where it is unknown */
  cv::Mat
  toColor(const cv::Mat& depth) const;

private:
  cv::Size color_size_;
  DepthRays rays_;
  DepthEdges edges_;   // between neighbouring pixels of the depth image
  float largest_cell_; // [px] of the colour image
};

} // namespace bundle_icp
