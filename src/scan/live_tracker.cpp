// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/live_tracker.h"

#include "registration/depth_alignment.h"
#include "registration/shared_error.h"
#include "scan/find_features.h"
#include "scan/live_verdict.h"

#include <bundle_icp/common/exceptions.h>

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Fewer pixels with depth than this share of the image are no frame. */
constexpr double MIN_MEASURED = 0.02;
constexpr const char* NO_DEPTH = "hardly any depth was measured";
/** Motion is extrapolated over at most so many intervals of time, and so long [s]. */
constexpr double MAX_EXTRAPOLATION = 3, LONGEST_GAP = 0.5;
/** Where motion or features give the start, ICP looks for surfaces within this distance [m]. */
constexpr double GUIDED_MISALIGNMENT = 0.03;
/** With as much the pose needs no good one before it. */
constexpr double CLEAR_OVERLAP = 0.75, CLEAR_AGREEMENT = 0.95;
/** A frame that shares less with any key frame becomes one; with much to do, only one that shares
 *  still less. */
constexpr double KEY_SHARE = 0.85, NEEDED_KEY_SHARE = 0.6;
/** So does one that no key frame is near to: in shares of the distance of what it sees, and [rad].
 */
constexpr double KEY_DISTANCE = 0.05, KEY_ANGLE = 0.08;
/** Key frames that may wait to be mapped before only needed ones are added. */
constexpr std::size_t FEW_WAITING = 1;
/** One of so many lost frames is tried by the mapper. */
constexpr std::size_t LOST_INTERVAL = 10;

/** Key frames whose points are looked for, points that say something, and the share of them that
 *  agrees with a pose. */
constexpr std::size_t PATCHED_KEYS = 2, MIN_PATCHES = 20;
constexpr double MIN_PATCH_SHARE = 0.6;

/** Key frames that a lost frame's features are matched with: of those that see what motion leads
 *  to, and of those that look alike. */
constexpr std::size_t NUM_COVISIBLE = 3, NUM_ALIKE = 6;

ScanSessionOptions
inOneThread(ScanSessionOptions options)
{
  options.reconstruction = options.reconstruction.withThreads();
  options.reconstruction.mapper.registration.virtual_depth.num_threads = 1;
  options.reconstruction.graph.matching.num_threads = 1;
  return options;
}

double
meanDepth(const DepthView& view)
{
  return cv::mean(view.depth, view.depth > 0)[0];
}

} // namespace

LiveTracker::LiveTracker(const CameraIntrinsics& camera, const ScanSessionOptions& options)
: camera_(camera), options_(inOneThread(options)),
  calibration_(options.reconstruction.mapper.refinement.calibration)
{
}

void
LiveTracker::update(const LiveMap& map)
{
  bundle_icp::update(map, key_frames_);
  if (!map.key_frames.empty())
    calibration_ = map.calibration;
}

LivePose
LiveTracker::track(const RGBDFrame& frame)
{
  const ReconstructionOptions& options = options_.reconstruction;
  frame_ = frame;
  features_.reset();
  patch_images_ = patchImages(frame.color);
  motion_.setZero();
  depth_from_color_ = world_from_depth_ = Pose::Identity();
  DepthViewStore store(camera_, options.depth_reduction, options.mapper.registration.virtual_depth,
                       DepthViewStore::NO_LIMIT, {});
  store.resize(1);
  store.set(0, frame.depth);
  view_ = store.get(0, calibration_, DepthError::Zero());
  pose_ = {};
  if (cv::countNonZero(view_->depth > 0) < MIN_MEASURED * double(view_->depth.total()))
    pose_.reason = NO_DEPTH;
  else if (key_frames_.empty())
    pose_ = begin();
  else
    pose_ = findPose();
  if (pose_.status != LiveStatus::LOST) {
    useMotionTo(world_from_depth_);
    pose_.world_from_camera = world_from_depth_ * depth_from_color_;
  }
  pose_.frame = frames_.size();
  pose_.timestamp = frame.timestamp;
  if (pose_.status == LiveStatus::LOST)
    pose_.world_from_camera = Pose::Identity();
  remember();
  return pose_;
}

/** The first frame is the world. */
LivePose
LiveTracker::begin() const
{
  LivePose pose;
  pose.status = LiveStatus::GOOD;
  pose.position_deviation = pose.rotation_deviation = 0;
  pose.overlap = 1;
  return pose;
}

/** Where the camera is by now when it moves as before; unset when that is too long ago. */
std::optional<Pose>
LiveTracker::guess(double timestamp) const
{
  if (!last_ || timestamp - last_->timestamp > LONGEST_GAP)
    return std::nullopt;
  const Pose last = poseOf(last_->anchor);
  if (!before_last_)
    return last;
  const double intervals =
      (timestamp - last_->timestamp) / (last_->timestamp - before_last_->timestamp);
  if (intervals > MAX_EXTRAPOLATION)
    return last;
  const Pose motion = poseOf(before_last_->anchor).inverse() * last;
  return last * increment(intervals * logarithm(motion));
}

/** Motion first, then features. */
LivePose
LiveTracker::findPose()
{
  const std::optional<Pose> start = guess(frame_.timestamp);
  LivePose best;
  best.reason = "no key frame is near, and features were not matched";
  if (start) {
    useMotionTo(*start);
    best = align(*start, nullptr);
    if (best.status != LiveStatus::LOST && refine(best)) {
      best.status = LiveStatus::GOOD; // images say so as well
      best.reason.clear();
      return best;
    }
    const bool is_clear = best.overlap >= CLEAR_OVERLAP && agreement_ >= CLEAR_AGREEMENT;
    if (best.status == LiveStatus::GOOD && (is_sure_ || is_clear))
      return best;
    if (best.status == LiveStatus::GOOD) {
      best.status = LiveStatus::DOUBTFUL;
      best.reason = "the frame before was doubtful or lost";
    }
  }
  const VisualMatches matched = matchWithKeyFrames(start);
  if (!matched.pose)
    return best;
  const Pose found = world_from_depth_;
  const LivePose visual =
      align(matched.pose->target_from_source * depth_from_color_.inverse(), &matched);
  if (visual.status <= best.status)
    return visual;
  world_from_depth_ = found;
  return best;
}

/** What the motion from the frames before to a pose says of the time between colour and depth. */
void
LiveTracker::useMotionTo(const Pose& world_from_depth)
{
  const std::optional<PastFrame>& past = before_last_ ? before_last_ : last_;
  if (past && frame_.timestamp - past->timestamp < LONGEST_GAP)
    motion_ = logarithm(world_from_depth.inverse() * poseOf(past->anchor)) /
              (frame_.timestamp - past->timestamp);
  depth_from_color_ = increment(calibration_[CalibrationParameter::TIME_OFFSET] * motion_);
}

/** Bundle ICP from a start that motion gives, or matched features. */
LivePose
LiveTracker::align(const Pose& start, const VisualMatches* matched)
{
  LivePose pose;
  pose.by_features = matched != nullptr;
  std::vector<DepthAlignment::View> views;
  std::vector<Pose> poses;
  for (const Covisible& other : findCovisible(key_frames_, *view_, start)) {
    if (views.size() == options_.max_views)
      break;
    views.push_back(key_frames_[other.key].view);
    poses.push_back(*key_frames_[other.key].world_from_depth);
  }
  if (views.empty()) {
    pose.reason = "no key frame sees what the frame shows";
    return pose;
  }
  DepthAlignment alignment(view_, options_.reconstruction.mapper.registration.virtual_depth);
  alignment.setVirtualDepth(views, poses, start);
  if (matched) {
    VisualCorrespondences points = matched->points;
    for (Eigen::Vector3d& point : points.source)
      point = depth_from_color_ * point;
    alignment.setVisualEvidence(points, matched->pose->scale);
  }
  AlignmentProblem problem = alignment.problem();
  problem.max_misalignment = GUIDED_MISALIGNMENT;
  const BundleICPResult icp = alignPoints(problem, start);
  agreement_ = icp.agreement;
  world_from_depth_ = icp.world_from_source;
  pose.world_from_camera = icp.world_from_source * depth_from_color_;
  const FrameRegistrationOptions& options = options_.reconstruction.mapper.registration;
  information_.setZero();
  if (hasConverged(icp.status))
    information_ = withSharedError(icp.information, *view_, camera_.depth_noise,
                                   options.shared_depth_sigmas, 1);
  judge(icp, start.inverse() * icp.world_from_source, matched, information_, options, pose);
  return pose;
}

/** With the places where the image shows points of key frames: pixels tell the pose better than
 *  depth, where motion has led near enough. \return false when they do not tell */
bool
LiveTracker::refine(LivePose& pose)
{
  const MovingCamera camera{camera_, calibration_.values, motion_};
  std::vector<std::size_t> keys;
  for (const Covisible& other : findCovisible(key_frames_, *view_, world_from_depth_))
    if (keys.size() < PATCHED_KEYS && !key_frames_[other.key].points.empty())
      keys.push_back(other.key);
  PatchPose found;
  found.world_from_camera = pose.world_from_camera;
  for (std::size_t level = 0; level < patch_images_.size(); ++level) {
    std::vector<SeenPoint> seen;
    for (const std::size_t k : keys) {
      const LiveKeyFrame& key = key_frames_[k];
      const std::vector<SeenPoint> of_key =
          findPatches({key.patch_images[level], *key.world_from_depth * key.depth_from_color,
                       &key.features->pixels, &key.points},
                      patch_images_[level], camera, found.world_from_camera);
      seen.insert(seen.end(), of_key.begin(), of_key.end());
    }
    if (seen.size() < MIN_PATCHES)
      return false;
    found = poseFromPatches(seen, camera, found.world_from_camera, pose.world_from_camera,
                            information_);
    if (double(found.inliers) < MIN_PATCH_SHARE * double(seen.size()))
      return false;
  }
  if (!isSmallCorrection(pose.world_from_camera.inverse() * found.world_from_camera))
    return false;
  pose.world_from_camera = found.world_from_camera;
  world_from_depth_ = found.world_from_camera * depth_from_color_.inverse();
  pose.inliers = found.inliers;
  setDeviations(found.information, pose);
  const FrameRegistrationOptions& options = options_.reconstruction.mapper.registration;
  return pose.position_deviation <= options.max_position_deviation &&
         pose.rotation_deviation <= options.max_rotation_deviation;
}

/** Of the frame's features, which it finds. */
VisualMatches
LiveTracker::matchWithKeyFrames(const std::optional<Pose>& guess)
{
  const ReconstructionOptions& options = options_.reconstruction;
  try {
    features_ = findFeatures(frame_, camera_, "frame " + std::to_string(frames_.size()), options);
  }
  catch (const pcl::IOException&) { // by the caller's function: finish() says so
    return {};
  }
  const auto isKnown = [this](std::size_t k) {
    return key_frames_[k].features && key_frames_[k].world_from_depth;
  };
  std::vector<std::size_t> keys;
  if (guess)
    for (const Covisible& other : findCovisible(key_frames_, *view_, *guess))
      if (keys.size() < NUM_COVISIBLE && isKnown(other.key))
        keys.push_back(other.key);
  const cv::Mat thumbnail = thumbnailOf(frame_.color);
  std::vector<std::pair<double, std::size_t>> alike;
  for (std::size_t k = 0; k < key_frames_.size(); ++k)
    if (isKnown(k) && std::find(keys.begin(), keys.end(), k) == keys.end())
      alike.emplace_back(-key_frames_[k].thumbnail.dot(thumbnail), k);
  std::sort(alike.begin(), alike.end());
  for (std::size_t i = 0; i < std::min(NUM_ALIKE, alike.size()); ++i)
    keys.push_back(alike[i].second);
  std::vector<KnownFeatures> known;
  for (const std::size_t k : keys)
    known.push_back({key_frames_[k].features.get(),
                     *key_frames_[k].world_from_depth * key_frames_[k].depth_from_color});
  return matchWithKnown(*features_, known, camera_, options.graph.matching,
                        options.mapper.registration.min_visual_inliers);
}

/** Keeps the pose relative to the key frame that sees most of the same. */
void
LiveTracker::remember()
{
  is_sure_ = pose_.status == LiveStatus::GOOD;
  covisible_ = pose_.status == LiveStatus::LOST
                   ? std::vector<Covisible>()
                   : findCovisible(key_frames_, *view_, world_from_depth_);
  frames_.emplace_back();
  if (covisible_.empty())
    return;
  const std::size_t key = covisible_.front().key;
  const Anchor anchor{key, key_frames_[key].world_from_depth->inverse() * world_from_depth_,
                      depth_from_color_};
  if (is_sure_)
    frames_.back() = anchor;
  before_last_ = last_;
  if (last_ && frame_.timestamp - last_->timestamp > LONGEST_GAP)
    before_last_.reset();
  last_ = PastFrame{anchor, frame_.timestamp};
}

std::optional<NewKeyFrame>
LiveTracker::chooseKeyFrame(std::size_t num_waiting)
{
  if (pose_.status == LiveStatus::GOOD ? !isKeyNeeded(num_waiting) : !isTried(num_waiting))
    return std::nullopt;
  NewKeyFrame added;
  added.images = frame_;
  added.motion = motion_;
  added.features = features_;
  LiveKeyFrame key;
  key.frame = pose_.frame;
  key.timestamp = frame_.timestamp;
  key.view = view_;
  key.patch_images = patch_images_;
  added.thumbnail = key.thumbnail = thumbnailOf(frame_.color);
  cv::resize(frame_.color, key.colors, view_->depth.size(), 0, 0, cv::INTER_AREA);
  if (pose_.status == LiveStatus::GOOD) {
    added.tracked = pose_.world_from_camera;
    key.world_from_depth = world_from_depth_;
    key.depth_from_color = depth_from_color_;
    for (const Covisible& other : covisible_)
      added.covisible.push_back(other.key);
    if (const std::optional<Anchor>& anchor = frames_.back()) {
      key.reference = anchor->key;
      key.reference_from_depth = anchor->key_from_depth;
    }
  }
  frames_.back() = Anchor{key_frames_.size(), Pose::Identity(), depth_from_color_};
  if (key_frames_.empty())
    last_ = PastFrame{*frames_.back(), frame_.timestamp};
  key_frames_.push_back(std::move(key));
  return added;
}

/** Whether the frame, whose pose is good, shows enough that no key frame does. */
bool
LiveTracker::isKeyNeeded(std::size_t num_waiting) const
{
  if (covisible_.empty())
    return true;
  const double share = covisible_.front().share;
  if (num_waiting > FEW_WAITING || share < NEEDED_KEY_SHARE)
    return share < NEEDED_KEY_SHARE;
  const double distance = KEY_DISTANCE * meanDepth(*view_);
  return share < KEY_SHARE ||
         std::none_of(covisible_.begin(), covisible_.end(), [&](const Covisible& other) {
           const Pose motion =
               key_frames_[other.key].world_from_depth->inverse() * world_from_depth_;
           return motion.translation().norm() < distance && rotationAngle(motion) < KEY_ANGLE;
         });
}

/** Whether the mapper should try the frame, which has no good pose. */
bool
LiveTracker::isTried(std::size_t num_waiting)
{
  if (pose_.reason == NO_DEPTH || ++since_tried_ < LOST_INTERVAL || num_waiting > 0)
    return false;
  since_tried_ = 0;
  return true;
}

std::vector<std::optional<Pose>>
LiveTracker::poses() const
{
  std::vector<std::optional<Pose>> poses(frames_.size());
  for (std::size_t i = 0; i < frames_.size(); ++i)
    if (frames_[i] && key_frames_[frames_[i]->key].world_from_depth)
      poses[i] = poseOf(*frames_[i]) * frames_[i]->depth_from_color;
  return poses;
}

} // namespace bundle_icp
