// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "simulation/scene.h"

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>

#include <opencv2/core.hpp>

namespace bundle_icp {
namespace simulation {

/** Surface points that the pixels' central rays meet; infinity and face -1 where there is none. */
struct GeometryImage {
  cv::Mat depth; ///< CV_32FC1 [m] along the optical axis
  cv::Mat face;  ///< CV_32SC1, index of the scene's face
};

/** Casts one ray through the centre of every pixel. */
GeometryImage
renderGeometry(const Scene& scene, const CameraIntrinsics& camera, const Pose& world_from_camera);

/** Colour (CV_8UC3, BGR) with a box filter over the pixel: filtered texture within a
 * face, several rays where faces meet. */
cv::Mat
renderColor(const Scene& scene, const CameraIntrinsics& camera, const Pose& world_from_camera,
            const GeometryImage& geometry);

/** Normals of the surface in the world frame, CV_32FC3. */
cv::Mat
renderNormals(const Scene& scene, const CameraIntrinsics& camera, const Pose& world_from_camera,
              const GeometryImage& geometry);

/** Share of a depth camera's light that each pixel reflects, 0 to 1: CV_32FC1.
 *  \param[in] color of the same view, CV_8UC3 */
cv::Mat
reflection(const Scene& scene, const CameraIntrinsics& camera, const Pose& world_from_camera,
           const GeometryImage& geometry, const cv::Mat& color);

} // namespace simulation
} // namespace bundle_icp
