// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/dataset_formats.h"

#include <opencv2/core/mat.hpp>

namespace bundle_icp {

/** The cameras that took the images of a recording, sizes and distortion included. */
struct RecordedCameras {
  CameraIntrinsics color;
  std::optional<DepthCamera> depth; ///< unset = depth lies in the colour camera's pixels
};

/** The images of one frame of a recording.
 *  \throws pcl::IOException naming file and reason. */
ImagePair
readImages(const Recording& recording, const RecordedFrame& frame);

/** Checks that the images of a frame have the sizes of their cameras.
 *  \param source of the intrinsics, for messages
 *  \throws UnsuitableImage naming file and sizes. */
void
checkSizes(const RecordedFrame& frame, const ImagePair& images, const RecordedCameras& cameras,
           const std::string& source);

/** The cameras of a recording by its intrinsics, or by the options' field of view. Frames are read
 *  until one is good, which gives the sizes that the recording does not say: a fault of the whole
 *  recording is found now, while a few bad files at its beginning do no harm.
 *  \throws pcl::IOException as readImages(), for the first bad frame; pcl::BadArgumentException for
 *  impossible intrinsics. */
RecordedCameras
findCameras(const Recording& recording, const std::string& folder, const DatasetOptions& options);

/** What is assumed about the cameras: notes `intrinsics` and, where depth has a camera of its own,
 *  `depth_camera`. */
std::vector<Finding>
describeCameras(const RecordedCameras& cameras, const Recording& recording);

} // namespace bundle_icp
