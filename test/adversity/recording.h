// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <functional>
#include <map>
#include <string>
#include <vector>

/** Recordings in memory that inputs of the adversity suite change and write. */
namespace adversity {

/** An image of a stream. */
struct Image {
  cv::Mat pixels;        ///< colour: CV_8UC3; depth: CV_16UC1 in units of the recording
  double time = 0;       ///< stamp in the lists [s]
  std::string name;      ///< of its file, without extension
  Eigen::Vector3d place; ///< true position of the camera when it was taken [m]
};

/** Folders as recorders leave them. */
enum class Layout {
  TUM,         ///< rgb.txt, depth.txt
  ONE_LIST,    ///< associations.txt
  OPEN3D,      ///< color/, depth/, intrinsic.json
  SEVEN_SCENES ///< frame-000000.color.png
};

struct Recording {
  std::vector<Image> color, depth;
  bundle_icp::CameraIntrinsics camera;
  double depth_scale = 5000; ///< units per metre, written to intrinsics.txt unless the format's
  Layout layout = Layout::TUM;
  bool has_calibration = true; ///< whether a file of the folder has the intrinsics
  std::string color_extension = ".png", depth_extension = ".png";
  std::function<std::string(double)> stamp;           ///< writes times; unset: s with six digits
  std::function<void(const std::string&)> afterwards; ///< changes the written folder
  std::vector<std::string> arguments;                 ///< of the program, beyond the usual
};

/** True positions by the colour image's path in the folder. */
using Places = std::map<std::string, Eigen::Vector3d>;

/** Writes a recording into a new folder. */
Places
write(const Recording& recording, const std::string& folder);

/** A recording without faults; no image when the shared recording that it is a part of is absent.
 *  \throws std::out_of_range for an unknown name. */
const Recording&
baseRecording(const std::string& name);

/** What the error of an input is measured against: the same camera and path without moving things
 *  or faults that the simulation adds; most recordings are their own reference. */
std::string
referenceOf(const std::string& base);

} // namespace adversity
