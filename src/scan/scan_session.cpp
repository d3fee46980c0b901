// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/scan/scan_session.h>

#include "graph/feature_checks.h"
#include "scan/kept_frames.h"
#include "scan/live_mapper.h"
#include "scan/live_tracker.h"
#include "scan/scan_surface.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/common/organized_cloud.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <sstream>

namespace bundle_icp {
namespace {

ScanSessionOptions
checked(const CameraIntrinsics& camera, const ScanSessionOptions& options)
{
  std::string error;
  if (!options.isValid(&error) || !camera.isValid(&error))
    throw BadArgumentException("ScanSession: " + error);
  if (camera.hasDistortion())
    throw BadArgumentException(
        "ScanSession: the camera has distortion; frames must be undistorted, "
        "and so their camera");
  ScanSessionOptions used = options;
  used.reconstruction = options.reconstruction.withThreads();
  return used;
}

void
checkImage(const char* kind, const cv::Mat& image, int type, const CameraIntrinsics& camera)
{
  if (image.type() != type || image.empty())
    throw BadArgumentException(std::string("ScanSession: the ") + kind + " image is " +
                               (image.empty() ? "empty" : cv::typeToString(image.type())) +
                               "; it must be " + cv::typeToString(type));
  if (image.cols != camera.width || image.rows != camera.height)
    throw BadArgumentException(std::string("ScanSession: the ") + kind + " image has " +
                               std::to_string(image.cols) + " x " + std::to_string(image.rows) +
                               " pixels, the camera " + std::to_string(camera.width) + " x " +
                               std::to_string(camera.height));
}

} // namespace

class ScanSession::Impl {
public:
  Impl(const CameraIntrinsics& camera, const ScanSessionOptions& options)
  : camera_(camera), options_(checked(camera, options)), frames_(camera),
    tracker_(camera, options_),
    mapper_(std::make_unique<LiveMapper>(camera, options_.reconstruction))
  {
  }

  void
  checkFrame(const RGBDFrame& frame) const;
  LivePose
  addFrame(const RGBDFrame& frame);
  /** Takes over what the mapper has found since, while there is one. */
  void
  update();
  LiveModel
  model();
  ReconstructionResult
  finish(const ProgressCallback& progress);
  /** The key frames as they are registered now, and their surface. */
  ReconstructionResult
  surface();

  const CameraIntrinsics camera_;
  const ScanSessionOptions options_;
  KeptFrames frames_;
  LiveTracker tracker_;
  std::unique_ptr<LiveMapper> mapper_; ///< null after finish()
  std::shared_ptr<const LiveMap> map_; ///< that the tracker has taken over
  Trajectory live_trajectory_;         ///< good poses as they were given
  double last_stamp_ = -std::numeric_limits<double>::infinity();
};

void
ScanSession::Impl::checkFrame(const RGBDFrame& frame) const
{
  if (!mapper_)
    throw BadArgumentException("ScanSession: no frame can be added after finish()");
  checkImage("colour", frame.color, CV_8UC3, camera_);
  checkImage("depth", frame.depth, CV_32FC1, camera_);
  if (!std::isfinite(frame.timestamp))
    throw BadArgumentException("ScanSession: the time stamp is not finite");
  if (frame.timestamp > last_stamp_)
    return;
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(15);
  text << "ScanSession: the time stamp " << frame.timestamp
       << " s is not later than that of the frame before, " << last_stamp_ << " s";
  throw BadArgumentException(text.str());
}

LivePose
ScanSession::Impl::addFrame(const RGBDFrame& frame)
{
  checkFrame(frame);
  last_stamp_ = frame.timestamp;
  const RGBDFrame own{frames_.size(), frame.timestamp, frame.color.clone(), frame.depth.clone()};
  frames_.add(own);
  if (options_.wait_for_mapping)
    mapper_->wait();
  update();
  LivePose pose = tracker_.track(own);
  if (pose.status == LiveStatus::GOOD)
    live_trajectory_.push_back({pose.timestamp, pose.world_from_camera});
  if (std::optional<NewKeyFrame> key = tracker_.chooseKeyFrame(mapper_->numWaiting())) {
    mapper_->add(std::move(*key));
    pose.is_key_frame = true;
  }
  return pose;
}

void
ScanSession::Impl::update()
{
  if (!mapper_)
    return;
  if (std::shared_ptr<const LiveMap> map = mapper_->map(); map != map_) {
    map_ = std::move(map);
    tracker_.update(*map_);
  }
}

LiveModel
ScanSession::Impl::model()
{
  LiveModel model;
  model.frames = frames_.size();
  model.points = std::make_shared<pcl::PointCloud<pcl::PointXYZRGB>>();
  if (mapper_) {
    model.waiting = mapper_->numWaiting();
    const std::shared_ptr<const LiveMap> map = mapper_->map();
    model.edges = map->edges;
    if (map->points)
      *model.points = *map->points;
  }
  update();
  for (const LiveKeyFrame& key : tracker_.keyFrames())
    if (key.is_mapped)
      model.trajectory.push_back({key.timestamp, *key.world_from_depth * key.depth_from_color});
  model.key_frames = model.trajectory.size();
  return model;
}

/** By the steps of reconstruct(). */
ReconstructionResult
ScanSession::Impl::surface()
{
  update();
  ReconstructionResult result;
  result.model.setCalibration(tracker_.calibration());
  result.frames.resize(frames_.size());
  for (const LiveKeyFrame& key : tracker_.keyFrames())
    if (key.world_from_depth) {
      FrameReport& frame = result.frames[key.frame];
      frame.registered = true;
      frame.component = 0;
      frame.world_from_depth = *key.world_from_depth;
      frame.world_from_camera = *key.world_from_depth * key.depth_from_color;
    }
  fuseSurface(frames_, options_.reconstruction, {}, {}, result);
  return result;
}

ReconstructionResult
ScanSession::Impl::finish(const ProgressCallback& progress)
{
  if (!mapper_)
    throw BadArgumentException("ScanSession: finish() was called before");
  update();
  mapper_.reset();
  ReconstructionResult result = reconstruct(frames_, options_.reconstruction, progress);
  result.live_trajectory = live_trajectory_;
  return result;
}

ScanSession::ScanSession(const CameraIntrinsics& camera, const ScanSessionOptions& options)
: impl_(std::make_unique<Impl>(camera, options))
{
}

ScanSession::~ScanSession() = default;

LivePose
ScanSession::addFrame(const RGBDFrame& frame)
{
  return impl_->addFrame(frame);
}

LivePose
ScanSession::addFrame(const pcl::PointCloud<pcl::PointXYZRGBA>& cloud, double stamp)
{
  return impl_->addFrame(toFrame(cloud, impl_->camera_, stamp));
}

LiveModel
ScanSession::model() const
{
  return impl_->model();
}

Trajectory
ScanSession::trajectory() const
{
  impl_->update();
  Trajectory trajectory;
  const std::vector<std::optional<Pose>> poses = impl_->tracker_.poses();
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (poses[i])
      trajectory.push_back({impl_->frames_.timestamp(i), *poses[i]});
  return trajectory;
}

pcl::PointCloud<pcl::PointXYZRGB>::Ptr
ScanSession::cloud() const
{
  impl_->update();
  auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZRGB>>();
  std::set<std::array<int, 3>> cells;
  const float spacing = float(impl_->options_.cloud_spacing);
  for (const LiveKeyFrame& key : impl_->tracker_.keyFrames()) {
    if (!key.world_from_depth)
      continue;
    for (int v = 0; v < key.colors.rows; ++v)
      for (int u = 0; u < key.colors.cols; ++u) {
        const float z = key.view->depth.at<float>(v, u);
        if (!(z > 0))
          continue;
        const Eigen::Vector3f point =
            (*key.world_from_depth * key.view->camera.unproject(u, v, z)).cast<float>();
        const Eigen::Vector3i cell = (point / spacing).array().floor().cast<int>();
        if (!cells.insert({cell.x(), cell.y(), cell.z()}).second)
          continue;
        const cv::Vec3b& color = key.colors.at<cv::Vec3b>(v, u);
        cloud->emplace_back(color[2], color[1], color[0]);
        cloud->back().getVector3fMap() = point;
      }
  }
  return cloud;
}

pcl::PolygonMesh
ScanSession::mesh() const
{
  return impl_->surface().mesh;
}

std::vector<NextView>
ScanSession::suggestions(const NextViewOptions& options) const
{
  return suggestViews(impl_->frames_, impl_->surface(), options);
}

std::size_t
ScanSession::storedBytes() const
{
  return impl_->frames_.bytes();
}

const RGBDDataset&
ScanSession::dataset() const
{
  return impl_->frames_;
}

ReconstructionResult
ScanSession::finish(const ProgressCallback& progress)
{
  return impl_->finish(progress);
}

} // namespace bundle_icp
