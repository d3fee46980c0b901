// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/recorded_cameras.h"

#include "io/image_file.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <cmath>

namespace bundle_icp {

namespace {

/** Images whose aspect ratios differ by less than this share may show the same view. */
constexpr double SAME_ASPECT = 0.02;

std::string
toString(const cv::Size& size)
{
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

cv::Size
sizeOf(const CameraIntrinsics& camera)
{
  return {camera.width, camera.height};
}

/** The camera whose images of another size show the same view. */
CameraIntrinsics
resized(const CameraIntrinsics& camera, const cv::Size& size)
{
  CameraIntrinsics result = camera;
  const double sx = double(size.width) / camera.width, sy = double(size.height) / camera.height;
  result.width = size.width;
  result.height = size.height;
  result.fx *= sx;
  result.fy *= sy;
  // Pixel centres are whole numbers: the edge at -0.5 is what the two grids share.
  result.cx = (camera.cx + 0.5) * sx - 0.5;
  result.cy = (camera.cy + 0.5) * sy - 0.5;
  return result;
}

bool
haveSameAspect(const cv::Size& a, const cv::Size& b)
{
  const double ratio = double(a.width) * b.height / (double(a.height) * b.width);
  return std::abs(ratio - 1) < SAME_ASPECT;
}

[[noreturn]] void
refuseDepthSize(const RecordedFrame& frame, const cv::Size& depth, const cv::Size& color)
{
  throw UnsuitableImage(frame.depth_file + ": depth of " + toString(depth) +
                        " where the colour image " + frame.color_file + " has " + toString(color) +
                        ": another view, whose camera is unknown; give it with --depth-intrinsics "
                        "fx,fy,cx,cy[,k1,k2,p1,p2,k3], and its place with --depth-to-color FILE");
}

void
setSize(CameraIntrinsics& camera, const cv::Size& size)
{
  if (camera.width != 0 || camera.height != 0)
    return;
  camera.width = size.width;
  camera.height = size.height;
}

void
checkCamera(const CameraIntrinsics& camera, const std::string& folder, const std::string& source)
{
  std::string error;
  if (!camera.isValid(&error))
    throw BadArgumentException(folder + ": " + error + " (from " + source + ")");
}

/** Whether both images have the size of the recording's depth camera, and not that of its colour
 *  camera: whoever wrote them has brought colour to depth. */
bool
isColorOfDepth(const Recording& recording, const cv::Size& color, const cv::Size& depth)
{
  return recording.depth_camera && color == depth && recording.intrinsics->width > 0 &&
         color != sizeOf(*recording.intrinsics) &&
         color == sizeOf(recording.depth_camera->intrinsics);
}

/** That of a field of view where one is given (> 0), else that of the recording. */
CameraIntrinsics
colorCamera(const Recording& recording, const ImagePair& images, double field_of_view)
{
  const cv::Size size = images.color.size();
  CameraIntrinsics camera = *recording.intrinsics;
  if (isColorOfDepth(recording, size, images.depth.size())) {
    camera = recording.depth_camera->intrinsics;
    camera.depth_noise = recording.intrinsics->depth_noise;
  }
  if (field_of_view > 0) {
    camera.cx = 0.5 * (size.width - 1);
    camera.cy = 0.5 * (size.height - 1);
    camera.fx = camera.fy = 0.5 * size.width / std::tan(0.5 * field_of_view);
  }
  setSize(camera, size);
  return camera;
}

/** Whether depth images have the size of colour, and not that of the recording's depth camera:
 *  whoever wrote them has registered them. */
bool
isRegistered(const DepthCamera& camera, const cv::Size& depth, const cv::Size& color)
{
  const cv::Size size = sizeOf(camera.intrinsics);
  return depth == color && size.area() > 0 && size != depth;
}

/** The recording's, or the colour camera resized where only the place or nothing is known. */
std::optional<DepthCamera>
depthCamera(const RecordedFrame& frame, const ImagePair& images, const Recording& recording,
            const CameraIntrinsics& color, bool undistort_depth)
{
  const cv::Size size = images.depth.size();
  std::optional<DepthCamera> camera = recording.depth_camera;
  if (camera ? isRegistered(*camera, size, images.color.size()) : size == images.color.size())
    return std::nullopt;
  if (isColorOfDepth(recording, images.color.size(), size))
    return std::nullopt;
  if (!camera)
    camera.emplace();
  if (camera->intrinsics.fx == 0) {
    if (!haveSameAspect(size, images.color.size()))
      refuseDepthSize(frame, size, images.color.size());
    camera->intrinsics = resized(undistort_depth ? color : color.undistorted(), size);
  }
  setSize(camera->intrinsics, size);
  return camera;
}

RecordedCameras
camerasOf(const RecordedFrame& frame, const Recording& recording, const std::string& folder,
          const DatasetOptions& options)
{
  const double field_of_view = options.intrinsics ? 0 : options.field_of_view.value_or(0);
  const ImagePair images = readImages(recording, frame);
  RecordedCameras cameras;
  cameras.color = colorCamera(recording, images, field_of_view);
  cameras.depth = depthCamera(frame, images, recording, cameras.color, options.undistort_depth);
  checkCamera(cameras.color, folder, recording.intrinsics_source);
  if (cameras.depth)
    checkCamera(cameras.depth->intrinsics, folder, "the camera of depth");
  checkSizes(frame, images, cameras, recording.intrinsics_source);
  return cameras;
}

} // namespace

ImagePair
readImages(const Recording& recording, const RecordedFrame& frame)
{
  if (recording.reader)
    return recording.reader->read(frame);
  return {readColorImage(frame.color_file), readDepthImage(frame.depth_file)};
}

void
checkSizes(const RecordedFrame& frame, const ImagePair& images, const RecordedCameras& cameras,
           const std::string& source)
{
  const cv::Size color = images.color.size(), depth = images.depth.size();
  if (!cameras.depth && depth != color)
    refuseDepthSize(frame, depth, color);
  if (color != sizeOf(cameras.color))
    throw UnsuitableImage(frame.color_file + ": image of " + toString(color) +
                          ", but the intrinsics (from " + source + ") are for " +
                          toString(sizeOf(cameras.color)));
  if (cameras.depth && depth != sizeOf(cameras.depth->intrinsics))
    throw UnsuitableImage(frame.depth_file + ": depth of " + toString(depth) +
                          ", but the camera of depth has images of " +
                          toString(sizeOf(cameras.depth->intrinsics)));
}

RecordedCameras
findCameras(const Recording& recording, const std::string& folder, const DatasetOptions& options)
{
  const std::size_t most_unsuitable = 10;
  std::size_t num_unsuitable = 0;
  std::exception_ptr first_error;
  for (const RecordedFrame& frame : recording.frames) {
    try {
      return camerasOf(frame, recording, folder, options);
    }
    catch (const UnsuitableImage&) {
      if (!first_error)
        first_error = std::current_exception();
      if (++num_unsuitable == most_unsuitable)
        break;
    }
    catch (const pcl::IOException&) {
      if (!first_error)
        first_error = std::current_exception();
    }
  }
  std::rethrow_exception(first_error);
}

std::vector<Finding>
describeCameras(const RecordedCameras& cameras, const Recording& recording)
{
  const auto px = [](double value) { return shortText(value, 6); };
  const auto describe = [&px](const CameraIntrinsics& camera) {
    return "fx " + px(camera.fx) + ", fy " + px(camera.fy) + ", centre " + px(camera.cx) + ", " +
           px(camera.cy) + " px in images of " + toString(sizeOf(camera)) +
           (camera.hasDistortion() ? ", with distortion" : "");
  };
  const CameraIntrinsics& color = cameras.color;
  std::vector<Finding> notes = {
      {Severity::NOTE,
       "intrinsics",
       "the camera has " + describe(color) + ", from " + recording.intrinsics_source,
       {{"fx_px", color.fx}, {"fy_px", color.fy}, {"cx_px", color.cx}, {"cy_px", color.cy}},
       ""}};
  if (!cameras.depth && recording.depth_camera)
    notes.push_back(
        {Severity::NOTE,
         "depth_camera",
         "depth counts as registered to colour: the images of both have one size, while "
         "the recording's cameras have images of two",
         {},
         ""});
  if (!cameras.depth)
    return notes;
  const CameraIntrinsics& depth = cameras.depth->intrinsics;
  const Pose& pose = cameras.depth->color_from_depth;
  const std::string what =
      recording.depth_camera
          ? "depth has a camera of its own with " + describe(depth) + ", " +
                shortText(1000 * pose.translation().norm(), 3) + " mm from the colour camera and " +
                "turned by " + shortText(rotationAngle(pose) * 180 / M_PI, 3) +
                " degrees; depth is moved into the colour images"
          : "depth images of " + toString(sizeOf(depth)) +
                " count as the same view as colour images of " + toString(sizeOf(color)) +
                ", as no camera of depth is known; depth is moved into the colour images";
  notes.push_back({Severity::NOTE,
                   "depth_camera",
                   what,
                   {{"depth_width_px", depth.width},
                    {"depth_height_px", depth.height},
                    {"depth_fx_px", depth.fx},
                    {"depth_fy_px", depth.fy},
                    {"distance_m", pose.translation().norm()}},
                   ""});
  return notes;
}

} // namespace bundle_icp
