// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/left_out.h"
#include "io/image_file.h"
#include "io/recordings/calibration_files.h"
#include "io/recordings/float_depth.h"
#include "io/recordings/masks.h"
#include "io/recordings/repeated_frames.h"
#include "io/recordings/seven_scenes_warp.h"
#include "io/recordings/unused_files.h"
#include "io/text_file.h"

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

ImagePair
readImages(const Recording& recording, const RecordedFrame& frame)
{
  const ImagePair images = recording.reader ? recording.reader->read(frame)
                                            : ImagePair{readColorImage(frame.color_file),
                                                        readDepthImage(frame.depth_file)};
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
  ImageFileDataset(Recording recording, const CameraIntrinsics& recorded_camera,
                   const DatasetOptions& options)
  : recording_(std::move(recording)), recorded_camera_(recorded_camera),
    camera_(recorded_camera.undistorted()), undistort_depth_(options.undistort_depth),
    warps_color_(recording_.is_seven_scenes && isSevenScenesDepthCamera(recorded_camera))
  {
    if (options.shuffle_seed)
      shuffle(recording_.frames, *options.shuffle_seed);
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

// What the frame's mask leaves out; empty without a mask.
cv::Mat
readLeftOut(const RecordedFrame& frame, const cv::Size& size)
{
  if (frame.mask_file.empty())
    return {};
  cv::Mat left_out = readMask(frame.mask_file, size);
  if (cv::countNonZero(left_out) == size.area())
    throw pcl::IOException(frame.mask_file + ": the mask leaves out the whole image");
  return left_out;
}

RGBDFrame
ImageFileDataset::read(std::size_t index) const
{
  const RecordedFrame& recorded = recording_.frames.at(index);
  auto [color, depth] = readImages(recording_, recorded);
  checkSize(recorded, color.size(), camera_, recording_.intrinsics_source);
  cv::Mat left_out = readLeftOut(recorded, color.size());
  if (warps_color_) {
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
  if (!left_out.empty())
    leaveOut(left_out, frame.depth);
  return frame;
}

// The camera of the recorded images, its size taken from them where the source has
// none; that of a field of view where one is given.
CameraIntrinsics
recordedCamera(const Recording& recording, const std::string& folder, const cv::Size& size,
               double field_of_view)
{
  CameraIntrinsics camera = recording.intrinsics.value_or(CameraIntrinsics());
  if (field_of_view > 0) {
    camera.cx = 0.5 * (size.width - 1);
    camera.cy = 0.5 * (size.height - 1);
    camera.fx = camera.fy = 0.5 * size.width / std::tan(0.5 * field_of_view);
  }
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
probeCamera(const Recording& recording, const std::string& folder, double field_of_view)
{
  const std::size_t most_unsuitable = 10;
  std::size_t num_unsuitable = 0;
  std::optional<pcl::IOException> first_error;
  for (const RecordedFrame& frame : recording.frames) {
    try {
      const cv::Size size = readImages(recording, frame).color.size();
      const CameraIntrinsics camera = recordedCamera(recording, folder, size, field_of_view);
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

// What was assumed about the images, and where that comes from.
void
sayAssumptions(const CameraIntrinsics& camera, const DatasetOptions& options, Recording& recording)
{
  const auto px = [](double value) { return shortText(value, 6); };
  const std::vector<Finding> notes = {
      {Severity::NOTE, "format", "the recording is read as " + recording.format, {}, ""},
      {Severity::NOTE,
       "units",
       "depth has " + px(recording.depth_scale * options.depth_factor) + " units per metre, from " +
           recording.depth_scale_source,
       {{"units_per_metre", recording.depth_scale * options.depth_factor}},
       ""},
      {Severity::NOTE,
       "intrinsics",
       "the camera has fx " + px(camera.fx) + ", fy " + px(camera.fy) + ", centre " +
           px(camera.cx) + ", " + px(camera.cy) + " px in images of " +
           toString({camera.width, camera.height}) +
           (camera.hasDistortion() ? ", with distortion" : "") + ", from " +
           recording.intrinsics_source,
       {{"fx_px", camera.fx}, {"fy_px", camera.fy}, {"cx_px", camera.cx}, {"cy_px", camera.cy}},
       ""}};
  recording.findings.insert(recording.findings.begin(), options.findings.begin(),
                            options.findings.end());
  recording.findings.insert(recording.findings.begin(), notes.begin(), notes.end());
}

void
refuseWithoutIntrinsics(const Recording& recording, const std::string& folder)
{
  std::string beside;
  for (const std::string& file : possibleCalibrationFiles(folder))
    beside += (beside.empty() ? "" : ", ") + file;
  throw pcl::IOException(folder + ": the camera's intrinsics are unknown (" + recording.format +
                         " recording without a calibration" +
                         (beside.empty() ? "" : " of a known form; in the folder lies " + beside) +
                         "); give them with --intrinsics fx,fy,cx,cy[,k1,k2,p1,p2,k3], or have the "
                         "focal length estimated by --intrinsics estimate");
}

} // namespace

RGBDDataset::Ptr
makeImageFileDataset(Recording recording, const std::string& folder, const DatasetOptions& options)
{
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
  if (options.depth_noise)
    recording.intrinsics->depth_noise = *options.depth_noise;
  const double field_of_view = options.intrinsics ? 0 : options.field_of_view.value_or(0);
  const CameraIntrinsics camera = probeCamera(recording, folder, field_of_view);
  sayAssumptions(camera, options, recording);
  if (options.use_masks)
    pairMasks(folder, options.max_time_difference, recording);
  const std::vector<Finding> unused = unusedFiles(recording, folder);
  recording.findings.insert(recording.findings.end(), unused.begin(), unused.end());
  select(recording.frames, options);
  leaveOutRepeatedFrames(recording);
  sayMasks({camera.width, camera.height}, recording);
  return std::make_shared<ImageFileDataset>(std::move(recording), camera, options);
}

} // namespace bundle_icp
