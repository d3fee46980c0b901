// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/baselines/frame_to_model.h>

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/registration/bundle_icp.h>
#include <bundle_icp/volume/tsdf_raycast.h>

#include <opencv2/core.hpp>

#include <cmath>
#include <optional>
#include <vector>

namespace bundle_icp {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZRGBNormal>;

/** Fewer pixels with depth than this share of the image are no frame. */
constexpr double MIN_MEASURED = 0.02;
/** Motion is extrapolated over at most so many intervals of time. */
constexpr double MAX_EXTRAPOLATION = 3;

/** Largest distance of ICP's pose from the pose of matched features: the largest error of the
 *  matches of two noisy frames [m, rad]. */
constexpr double MAX_CORRECTION = 0.1;

/** Where to start ICP. */
struct Guess {
  Pose world_from_camera = Pose::Identity();
  bool is_visual = false; ///< features agree on it
};

/** Data of a tracked frame for later frames. */
struct PastFrame {
  Pose world_from_camera = Pose::Identity();
  double timestamp = 0; ///< [s]
};

TrackingOptions
withThreads(TrackingOptions options)
{
  options.volume.num_threads = options.num_threads;
  options.matching.num_threads = options.num_threads;
  options.depth.num_threads = options.num_threads;
  return options;
}

} // namespace

class FrameToModelTracker::Impl {
public:
  Impl(const CameraIntrinsics& camera, const TrackingOptions& options)
  : camera_(camera), options_(withThreads(options)), volume_(options_.volume)
  {
  }

  FrameRegistration
  track(const RGBDFrame& frame, const Features& features);

  const TSDFVolume&
  volume() const
  {
    return volume_;
  }

private:
  VisualCorrespondences
  matchWithLast(const Features& features) const;
  bool
  isTrustworthy(const FrameRegistration& found, const Guess& guess) const;
  std::vector<Guess>
  guesses(const std::optional<RigidAlignment>& visual_pose, double timestamp) const;
  FrameRegistration
  findPose(const Cloud::Ptr& source, const Features& features, double timestamp) const;
  FrameRegistration
  align(const Cloud::Ptr& source, const Pose& guess) const;
  void
  remember(const RGBDFrame& frame, const Features& features, const Pose& world_from_camera);

  const CameraIntrinsics camera_;
  const TrackingOptions options_;
  TSDFVolume volume_;
  std::optional<PastFrame> last_, before_last_; ///< unset: no velocity is known
  Features last_features_;
};

FrameRegistration
FrameToModelTracker::Impl::track(const RGBDFrame& frame, const Features& features)
{
  FrameRegistration result;
  const DepthView view =
      makeDepthView(frame.depth, camera_, options_.depth_reduction, options_.depth);
  if (cv::countNonZero(view.depth > 0) < MIN_MEASURED * double(view.depth.total())) {
    result.reason = "hardly any depth was measured";
    return result;
  }
  if (last_)
    result = findPose(toPointCloud(view), features, frame.timestamp);
  else {
    result.registered = true;
    result.overlap = 1; // the model will be this frame
  }
  if (result.registered) {
    volume_.integrate(frame, camera_, result.world_from_camera);
    remember(frame, features, result.world_from_camera);
  }
  else {
    before_last_.reset();
    result.reason = "lost: only " + std::to_string(int(100 * result.overlap)) +
                    " % of the depth lies on the model";
  }
  return result;
}

/** The first pose that passes; else the pose of largest overlap. */
FrameRegistration
FrameToModelTracker::Impl::findPose(const Cloud::Ptr& source, const Features& features,
                                    double timestamp) const
{
  const VisualCorrespondences visual = matchWithLast(features);
  const std::optional<RigidAlignment> visual_pose = estimateVisualPose(visual);
  FrameRegistration best;
  for (const Guess& guess : guesses(visual_pose, timestamp)) {
    FrameRegistration found = align(source, guess.world_from_camera);
    found.registered = isTrustworthy(found, guess);
    if (found.registered || found.overlap >= best.overlap)
      best = found;
    if (found.registered)
      break;
  }
  best.matches = visual.source.size();
  best.inliers = visual_pose ? visual_pose->inliers.size() : 0;
  return best;
}

bool
FrameToModelTracker::Impl::isTrustworthy(const FrameRegistration& found, const Guess& guess) const
{
  const Pose correction = guess.world_from_camera.inverse() * found.world_from_camera;
  const bool do_features_agree = guess.is_visual &&
                                 correction.translation().norm() <= MAX_CORRECTION &&
                                 rotationAngle(correction) <= MAX_CORRECTION;
  return found.overlap >=
         (do_features_agree ? options_.min_overlap_with_features : options_.min_overlap);
}

VisualCorrespondences
FrameToModelTracker::Impl::matchWithLast(const Features& features) const
{
  VisualCorrespondences visual;
  if (features.size() == 0 || last_features_.size() == 0)
    return visual;
  const FramePair pair = verifyMatches(
      last_features_, features,
      matchDescriptors(last_features_.descriptors, features.descriptors, options_.matching),
      camera_, options_.matching);
  for (const FeatureMatch& match : pair.matches) {
    visual.source.push_back(pointInCamera(features, match.second, camera_));
    visual.target.push_back(last_->world_from_camera *
                            pointInCamera(last_features_, match.first, camera_));
    visual.weights.push_back(1 / (pointVariance(features, match.second, camera_) +
                                  pointVariance(last_features_, match.first, camera_)));
  }
  return visual;
}

/** Where the camera may be by now, the likeliest first. Matches only give the start:
 * held against a single noisy frame, they would pull ICP away from the model. */
std::vector<Guess>
FrameToModelTracker::Impl::guesses(const std::optional<RigidAlignment>& visual_pose,
                                   double timestamp) const
{
  std::vector<Guess> guesses;
  if (visual_pose)
    guesses.push_back({visual_pose->target_from_source, true});
  if (before_last_) {
    const double intervals =
        (timestamp - last_->timestamp) / (last_->timestamp - before_last_->timestamp);
    const Pose motion = before_last_->world_from_camera.inverse() * last_->world_from_camera;
    if (std::abs(intervals) <= MAX_EXTRAPOLATION)
      guesses.push_back({last_->world_from_camera * increment(intervals * logarithm(motion))});
  }
  guesses.push_back({last_->world_from_camera});
  return guesses;
}

FrameRegistration
FrameToModelTracker::Impl::align(const Cloud::Ptr& source, const Pose& guess) const
{
  const CameraIntrinsics camera = camera_.reduced(options_.depth_reduction);
  const auto render = [&](const Pose& world_from_virtual) {
    return raycast(volume_, camera, world_from_virtual, options_.num_threads);
  };
  BundleICP<pcl::PointXYZRGBNormal, pcl::PointXYZRGBNormal> icp;
  icp.setNumberOfThreads(options_.num_threads);
  icp.setCameraIntrinsics(camera);
  icp.setInputSource(source);
  icp.setInputTarget(render(guess));
  icp.setVirtualDepthPose(guess);
  icp.setVirtualDepthRenderer(render);
  Cloud aligned;
  icp.align(aligned, guess.matrix().cast<float>());
  const BundleICPResult& found = icp.getResult();
  FrameRegistration result;
  result.world_from_camera = closestPose(icp.getFinalTransformation().cast<double>());
  result.overlap = found.overlap;
  result.icp_rmse = found.rmse;
  return result;
}

void
FrameToModelTracker::Impl::remember(const RGBDFrame& frame, const Features& features,
                                    const Pose& world_from_camera)
{
  before_last_ = last_;
  last_ = PastFrame{world_from_camera, frame.timestamp};
  last_features_ = features;
}

bool
TrackingOptions::isValid(std::string* error) const
{
  std::string reason;
  if (depth_reduction < 1 || depth_reduction > 8)
    reason = "depth_reduction must lie in 1 ... 8";
  else if (!(min_overlap > 0 && min_overlap <= 1 && min_overlap_with_features > 0 &&
             min_overlap_with_features <= 1))
    reason = "min_overlap and min_overlap_with_features must lie in (0, 1]";
  else if (num_threads < 0)
    reason = "num_threads must be >= 0";
  else
    volume.isValid(&reason) && matching.isValid(&reason) && depth.isValid(&reason);
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

FrameToModelTracker::FrameToModelTracker(const CameraIntrinsics& camera,
                                         const TrackingOptions& options)
{
  std::string error;
  if (!options.isValid(&error) || !camera.isValid(&error))
    throw BadArgumentException("FrameToModelTracker: " + error);
  impl_ = std::make_unique<Impl>(camera, options);
}

FrameToModelTracker::~FrameToModelTracker() = default;

FrameRegistration
FrameToModelTracker::track(const RGBDFrame& frame, const Features& features)
{
  return impl_->track(frame, features);
}

const TSDFVolume&
FrameToModelTracker::volume() const
{
  return impl_->volume();
}

} // namespace bundle_icp
