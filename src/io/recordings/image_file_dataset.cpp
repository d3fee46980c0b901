// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/left_out.h"

#include "io/image_file.h"
#include "io/recordings/calibration_files.h"
#include "io/recordings/depth_registration.h"
#include "io/recordings/float_depth.h"
#include "io/recordings/masks.h"
#include "io/recordings/pose_priors.h"
#include "io/recordings/recorded_cameras.h"
#include "io/recordings/repeated_frames.h"
#include "io/recordings/seven_scenes_warp.h"
#include "io/recordings/unused_files.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include <cmath>
#include <random>

namespace bundle_icp {

namespace {

// Stride and number of frames that the options ask for.
void
select(std::vector<RecordedFrame>& frames, const DatasetOptions& options)
{
  std::vector<RecordedFrame> selected;
  for (std::size_t i = 0; i < frames.size(); i += options.stride)
    if (options.max_frames == 0 || selected.size() < options.max_frames)
      selected.push_back(frames[i]);
  frames = std::move(selected);
}

// Fisher-Yates by hand: std::shuffle may differ between standard libraries. The bias of the
// remainder is below 1e-13.
void
shuffle(std::vector<RecordedFrame>& frames, std::uint64_t seed)
{
  std::mt19937_64 random(seed);
  for (std::size_t i = frames.size(); i > 1; --i)
    std::swap(frames[i - 1], frames[random() % i]);
}

class ImageFileDataset : public RGBDDataset {
public:
  ImageFileDataset(Recording recording, const RecordedCameras& recorded,
                   const DatasetOptions& options)
  : recording_(std::move(recording)), recorded_(recorded), camera_(recorded.color.undistorted()),
    undistort_depth_(options.undistort_depth && !recorded.depth),
    warps_color_(recording_.is_seven_scenes)
  {
    if (options.shuffle_seed)
      shuffle(recording_.frames, *options.shuffle_seed);
    if (recorded.color.hasDistortion())
      makeUndistortionMaps();
    if (recorded.depth)
      depth_registration_.emplace(*recorded.depth, camera_);
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

  std::string
  recording(std::size_t /*index*/) const override
  {
    return recording_.path;
  }

  RGBDFrame
  read(std::size_t index) const override;

  bool
  isOrdered() const override
  {
    return recording_.is_ordered;
  }

  bool
  hasTimes() const override
  {
    return recording_.has_times;
  }

  std::vector<Finding>
  findings() const override
  {
    return recording_.findings;
  }

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

  std::optional<PosePrior>
  prior(std::size_t index) const override
  {
    return recording_.frames.at(index).prior;
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
  RecordedCameras recorded_;
  CameraIntrinsics camera_;
  bool undistort_depth_, warps_color_;
  std::optional<DepthRegistration> depth_registration_; // unset where depth is registered
  cv::Mat map_, map_fraction_;                          // fixed-point; empty without distortion
};

void
ImageFileDataset::makeUndistortionMaps()
{
  const CameraIntrinsics& c = recorded_.color;
  const cv::Matx33d matrix(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
  const cv::Matx<double, 1, 5> distortion(c.k1, c.k2, c.p1, c.p2, c.k3);
  cv::initUndistortRectifyMap(matrix, distortion, cv::Matx33d::eye(), matrix, {c.width, c.height},
                              CV_16SC2, map_, map_fraction_);
}

// What the frame's mask leaves out; empty without a mask.
cv::Mat
readLeftOut(const RecordedFrame& frame, const cv::Size& size)
{
  if (frame.mask_file.empty())
    return {};
  cv::Mat left_out = readMask(frame.mask_file, size);
  if (cv::countNonZero(left_out) == size.area())
    throw IOException(frame.mask_file + ": the mask leaves out the whole image");
  return left_out;
}

RGBDFrame
ImageFileDataset::read(std::size_t index) const
{
  const RecordedFrame& recorded = recording_.frames.at(index);
  const ImagePair images = readImages(recording_, recorded);
  checkSizes(recorded, images, recorded_, recording_.intrinsics_source);
  cv::Mat color = images.color, depth = images.depth;
  cv::Mat left_out = readLeftOut(recorded, color.size());
  if (warps_color_) {
    if (depth.type() != CV_16UC1)
      throw IOException(recorded.depth_file + ": depth of floats, where 7-Scenes has millimetres");
    color = warpSevenScenesColor(color, depth);
    if (!left_out.empty())
      left_out = warpSevenScenesColor(left_out, depth) >= 128; // a mask belongs to colour
  }
  if (!map_.empty()) {
    cv::Mat undistorted_color, undistorted_depth;
    cv::remap(color, undistorted_color, map_, map_fraction_, cv::INTER_LINEAR,
              cv::BORDER_REPLICATE);
    color = undistorted_color;
    if (!left_out.empty()) {
      cv::Mat undistorted_mask;
      cv::remap(left_out, undistorted_mask, map_, map_fraction_, cv::INTER_NEAREST,
                cv::BORDER_CONSTANT);
      left_out = undistorted_mask;
    }
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
  if (depth_registration_)
    frame.depth = depth_registration_->toColor(frame.depth);
  if (!left_out.empty())
    leaveOut(left_out, frame.depth);
  return frame;
}

// What was assumed about the images, and where that comes from.
void
sayAssumptions(const RecordedCameras& cameras, const DatasetOptions& options, Recording& recording)
{
  const double units = recording.depth_scale * options.depth_factor;
  std::vector<Finding> notes = {
      {Severity::NOTE, "format", "the recording is read as " + recording.format, {}, ""},
      {Severity::NOTE,
       "units",
       "depth has " + shortText(units, 6) + " units per metre, from " +
           recording.depth_scale_source,
       {{"units_per_metre", units}},
       ""}};
  for (const std::vector<Finding>& more : {describeCameras(cameras, recording), options.findings})
    notes.insert(notes.end(), more.begin(), more.end());
  recording.findings.insert(recording.findings.begin(), notes.begin(), notes.end());
}

// Colour is warped only for the cameras of 7-Scenes themselves, and with depth in millimetres.
void
decideWarp(const RecordedCameras& cameras, const DatasetOptions& options, Recording& recording)
{
  const double units = recording.depth_scale * options.depth_factor;
  recording.is_seven_scenes = recording.is_seven_scenes && !cameras.depth &&
                              std::abs(units - 1000) < 1e-6 &&
                              isSevenScenesDepthCamera(cameras.color);
  if (recording.is_seven_scenes)
    recording.findings.push_back(
        {Severity::NOTE,
         "color_and_depth",
         "colour is warped into the depth camera, since the camera is that of 7-Scenes, whose "
         "colour camera is 25 mm beside it",
         {},
         ""});
}

// A calibration file that cannot be read does no harm where the options say what the camera is.
void
leaveOutCalibration(const DatasetOptions& options, Recording& recording)
{
  if (!options.intrinsics && !options.field_of_view)
    throw IOException(recording.calibration_fault);
  recording.findings.push_back({Severity::WARNING,
                                "intrinsics",
                                "the calibration file is not used, its units and its camera of "
                                "depth neither: " +
                                    recording.calibration_fault,
                                {},
                                "give with --depth-scale and --depth-intrinsics what differs"});
}

void
takeDepthCamera(const DatasetOptions& options, Recording& recording)
{
  if (!options.depth_intrinsics && !options.color_from_depth)
    return;
  if (!recording.depth_camera)
    recording.depth_camera.emplace();
  DepthCamera& camera = *recording.depth_camera;
  camera.intrinsics = options.depth_intrinsics.value_or(camera.intrinsics);
  camera.color_from_depth = options.color_from_depth.value_or(camera.color_from_depth);
}

void
refuseWithoutIntrinsics(const Recording& recording, const std::string& folder)
{
  std::string beside;
  for (const std::string& file : possibleCalibrationFiles(folder))
    beside += (beside.empty() ? "" : ", ") + file;
  throw IOException(folder + ": the camera's intrinsics are unknown (" + recording.format +
                    " recording without a calibration" +
                    (beside.empty() ? "" : " of a known form; in the folder lies " + beside) +
                    "); give them with --intrinsics fx,fy,cx,cy[,k1,k2,p1,p2,k3], or have the "
                    "focal length estimated by --intrinsics estimate");
}

} // namespace

RGBDDataset::Ptr
makeImageFileDataset(Recording recording, const std::string& folder, const DatasetOptions& options)
{
  if (!recording.calibration_fault.empty())
    leaveOutCalibration(options, recording);
  if (options.intrinsics) {
    recording.intrinsics = options.intrinsics;
    recording.intrinsics_source = options.intrinsics_source;
  }
  else if (options.field_of_view) {
    recording.intrinsics.emplace();
    recording.intrinsics_source = "a field of view of " +
                                  shortText(*options.field_of_view * 180 / M_PI, 3) +
                                  " degrees that is assumed";
  }
  useMetresOfFloats(recording);
  if (options.depth_scale)
    recording.depth_scale_source = "the options";
  recording.depth_scale =
      options.depth_scale.value_or(recording.depth_scale) / options.depth_factor;
  if (!recording.intrinsics)
    refuseWithoutIntrinsics(recording, folder);
  if (recording.is_turned_down)
    recording.intrinsics->fy = std::abs(recording.intrinsics->fy);
  if (options.depth_noise)
    recording.intrinsics->depth_noise = *options.depth_noise;
  takeDepthCamera(options, recording);
  const RecordedCameras cameras = findCameras(recording, folder, options);
  decideWarp(cameras, options, recording);
  sayAssumptions(cameras, options, recording);
  if (options.use_masks)
    pairMasks(folder, options.max_time_difference, recording);
  const std::vector<Finding> unused = unusedFiles(recording, folder);
  recording.findings.insert(recording.findings.end(), unused.begin(), unused.end());
  select(recording.frames, options);
  leaveOutRepeatedFrames(recording);
  takePriors(options, folder, recording);
  sayMasks({cameras.color.width, cameras.color.height}, recording);
  return std::make_shared<ImageFileDataset>(std::move(recording), cameras, options);
}

} // namespace bundle_icp
