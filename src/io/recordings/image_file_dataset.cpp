// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/image_file.h"
#include "io/recordings/dataset_formats.h"
#include "io/recordings/seven_scenes_warp.h"

#include <boost/filesystem.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <pcl/exceptions.h>

#include <random>

namespace bundle_icp {

namespace {

std::string
toString(const cv::Size& size)
{
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

struct ImagePair {
  cv::Mat color, depth;
};

ImagePair
readImages(const RecordedFrame& frame)
{
  ImagePair images{readColorImage(frame.color_file), readDepthImage(frame.depth_file)};
  if (images.color.size() != images.depth.size())
    throw UnsuitableImage(frame.depth_file + ": depth of " + toString(images.depth.size()) +
                          " where the colour image " + frame.color_file + " has " +
                          toString(images.color.size()) + "; sizes must be equal");
  return images;
}

void
checkSize(const RecordedFrame& frame, const cv::Size& size, const CameraIntrinsics& camera,
          const std::string& source)
{
  if (size != cv::Size(camera.width, camera.height))
    throw UnsuitableImage(frame.color_file + ": image of " + toString(size) +
                          ", but the intrinsics (from " + source + ") are for " +
                          toString({camera.width, camera.height}));
}

// Stride, number and order of frames that the options ask for.
void
select(std::vector<RecordedFrame>& frames, const DatasetOptions& options)
{
  std::vector<RecordedFrame> selected;
  for (std::size_t i = 0; i < frames.size(); i += options.stride)
    if (options.max_frames == 0 || selected.size() < options.max_frames)
      selected.push_back(frames[i]);
  if (options.shuffle_seed) {
    // Fisher-Yates by hand: std::shuffle may differ between standard libraries. The
    // bias of the remainder is below 1e-13.
    std::mt19937_64 random(*options.shuffle_seed);
    for (std::size_t i = selected.size(); i > 1; --i)
      std::swap(selected[i - 1], selected[random() % i]);
  }
  frames = std::move(selected);
}

class ImageFileDataset : public RGBDDataset {
public:
  ImageFileDataset(Recording recording, const CameraIntrinsics& recorded_camera,
                   const DatasetOptions& options)
  : recording_(std::move(recording)), recorded_camera_(recorded_camera),
    camera_(recorded_camera.undistorted()), undistort_depth_(options.undistort_depth),
    warps_color_(recording_.is_seven_scenes && isSevenScenesDepthCamera(recorded_camera))
  {
    select(recording_.frames, options);
    if (recorded_camera.hasDistortion())
      makeUndistortionMaps();
  }

  std::size_t
  size() const override
  {
    return recording_.frames.size();
  }

  const CameraIntrinsics&
  camera() const override
  {
    return camera_;
  }

  std::size_t
  id(std::size_t index) const override
  {
    return recording_.frames.at(index).id;
  }

  double
  timestamp(std::size_t index) const override
  {
    return recording_.frames.at(index).timestamp;
  }

  std::string
  name(std::size_t index) const override
  {
    return recording_.frames.at(index).color_file;
  }

  RGBDFrame
  read(std::size_t index) const override;

  std::string
  format() const override
  {
    return recording_.format;
  }

  Trajectory
  groundTruth() const override
  {
    return recording_.ground_truth;
  }

  std::vector<SkippedFile>
  skipped() const override
  {
    return recording_.skipped;
  }

private:
  void
  makeUndistortionMaps();

  Recording recording_;
  CameraIntrinsics recorded_camera_, camera_;
  bool undistort_depth_, warps_color_;
  cv::Mat map_, map_fraction_; // fixed-point; empty without distortion
};

void
ImageFileDataset::makeUndistortionMaps()
{
  const CameraIntrinsics& c = recorded_camera_;
  const cv::Matx33d matrix(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
  const cv::Matx<double, 1, 5> distortion(c.k1, c.k2, c.p1, c.p2, c.k3);
  cv::initUndistortRectifyMap(matrix, distortion, cv::Matx33d::eye(), matrix, {c.width, c.height},
                              CV_16SC2, map_, map_fraction_);
}

RGBDFrame
ImageFileDataset::read(std::size_t index) const
{
  const RecordedFrame& recorded = recording_.frames.at(index);
  auto [color, depth] = readImages(recorded);
  checkSize(recorded, color.size(), camera_, recording_.intrinsics_source);
  if (warps_color_)
    color = warpSevenScenesColor(color, depth);
  if (!map_.empty()) {
    cv::Mat undistorted_color, undistorted_depth;
    cv::remap(color, undistorted_color, map_, map_fraction_, cv::INTER_LINEAR,
              cv::BORDER_REPLICATE);
    color = undistorted_color;
    if (undistort_depth_) {
      // Nearest neighbour: a mean of two depths is a point on neither surface.
      cv::remap(depth, undistorted_depth, map_, map_fraction_, cv::INTER_NEAREST,
                cv::BORDER_CONSTANT);
      depth = undistorted_depth;
    }
  }
  RGBDFrame frame;
  frame.id = recorded.id;
  frame.timestamp = recorded.timestamp;
  frame.color = color;
  frame.depth = depthInMetres(depth, recording_.depth_scale);
  return frame;
}

// The camera of the recorded images, its size taken from them where the source has
// none.
CameraIntrinsics
recordedCamera(const Recording& recording, const std::string& folder, const cv::Size& size)
{
  CameraIntrinsics camera = *recording.intrinsics;
  if (camera.width == 0 && camera.height == 0) {
    camera.width = size.width;
    camera.height = size.height;
  }
  std::string error;
  if (!camera.isValid(&error))
    throw pcl::BadArgumentException(folder + ": " + error + " (from " +
                                    recording.intrinsics_source + ")");
  return camera;
}

// Reads frames until one is good, so that a fault of the whole recording is found now,
// while a few bad files at its beginning do no harm.
CameraIntrinsics
probeCamera(const Recording& recording, const std::string& folder)
{
  const std::size_t most_unsuitable = 10;
  std::size_t num_unsuitable = 0;
  std::optional<pcl::IOException> first_error;
  for (const RecordedFrame& frame : recording.frames) {
    try {
      const cv::Size size = readImages(frame).color.size();
      const CameraIntrinsics camera = recordedCamera(recording, folder, size);
      checkSize(frame, size, camera, recording.intrinsics_source);
      return camera;
    }
    catch (const UnsuitableImage& error) {
      if (!first_error)
        first_error = error;
      if (++num_unsuitable == most_unsuitable)
        break;
    }
    catch (const pcl::IOException& error) {
      if (!first_error)
        first_error = error;
    }
  }
  throw *first_error;
}

} // namespace

RGBDDataset::Ptr
makeImageFileDataset(Recording recording, const std::string& folder, const DatasetOptions& options)
{
  if (options.intrinsics) {
    recording.intrinsics = options.intrinsics;
    recording.intrinsics_source = "the options";
  }
  recording.depth_scale =
      options.depth_scale.value_or(recording.depth_scale) / options.depth_factor;
  if (!recording.intrinsics)
    throw pcl::IOException(folder + ": the camera's intrinsics are unknown (" + recording.format +
                           " recording without a calibration); give them " +
                           "with --intrinsics fx,fy,cx,cy[,k1,k2,p1,p2,k3]");
  if (options.depth_noise)
    recording.intrinsics->depth_noise = *options.depth_noise;
  const CameraIntrinsics camera = probeCamera(recording, folder);
  return std::make_shared<ImageFileDataset>(std::move(recording), camera, options);
}

} // namespace bundle_icp
