// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/live_model.h"

#include "common/parallel.h"
#include "refinement/false_connections.h"
#include "scan/find_features.h"
#include "scan/live_features.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <set>

namespace bundle_icp {
namespace {

/** All key frames are in one component. */
constexpr int COMPONENT = 0;
/** Frames that hold a local adjustment in place. */
constexpr std::size_t NUM_HELD = 10;
/** The model is adjusted for the first time with so many key frames, and then each time that it has
 *  grown by this factor. */
constexpr double FIRST_ADJUSTMENT = 4, ADJUSTMENT_GROWTH = 1.3;
/** Key frames that a new one is matched with: those that tracking says it sees the same with, and
 *  those that look alike, which closes loops. */
constexpr std::size_t NUM_COVISIBLE = 20, NUM_ALIKE = 10;
/** The camera is calibrated with so many key frames, and anew each time that they have grown by
 *  this factor, up to a number that tells all. */
constexpr double FIRST_CALIBRATION = 16, CALIBRATION_GROWTH = 1.6, LAST_CALIBRATION = 100;

/** Lets the graph match a new node with chosen ones alone: of others it knows that they share
 *  nothing. */
class ChosenPairs : public MatchStore {
public:
  explicit ChosenPairs(std::set<std::size_t> partners) : partners_(std::move(partners)) {}

  std::optional<FramePair>
  find(std::size_t first, std::size_t second) override
  {
    if (partners_.count(std::min(first, second)))
      return std::nullopt;
    FramePair none;
    none.first = first;
    none.second = second;
    return none;
  }

  void
  add(const FramePair&) override
  {
  }

private:
  const std::set<std::size_t> partners_; ///< of the newest node
};

ImageGraphOptions
graphOptions(ImageGraphOptions options)
{
  options.exhaustive_limit = std::numeric_limits<std::size_t>::max(); // see ChosenPairs
  return options;
}

/** Motions come from tracking: the stamps of key frames alone are too far apart. */
ReconstructionOptions
liveOptions(ReconstructionOptions options)
{
  options.mapper.schedule.ordered_in_time = false;
  options.mapper.refinement.pose_prior = false;
  return options;
}

} // namespace

LiveSparseModel::LiveSparseModel(const CameraIntrinsics& camera,
                                 const ReconstructionOptions& options)
: options_(liveOptions(options)), graph_(camera, graphOptions(options.graph)),
  depths_(camera, options.depth_reduction, options.mapper.registration.virtual_depth,
          DepthViewStore::NO_LIMIT, {}),
  view_of_([this](std::size_t frame, const SparseModel&) { return views_[frame]; }),
  next_adjustment_(FIRST_ADJUSTMENT), next_calibration_(FIRST_CALIBRATION)
{
  forgetCalibration();
}

/** What the scan says of the camera is found anew. */
void
LiveSparseModel::forgetCalibration()
{
  model_.setCalibration(options_.mapper.refinement.calibration);
  for (std::size_t k = 0; k < frames_.size(); ++k)
    model_.setDepthError(k, DepthError::Zero());
  registrar_.emplace(graph_, view_of_, options_.mapper.registration, options_.mapper.adjustment);
  adjuster_.emplace(graph_, *registrar_, options_.mapper);
}

/** Key frames that the next one may share features with. */
std::set<std::size_t>
LiveSparseModel::partners(const NewKeyFrame& frame) const
{
  std::set<std::size_t> partners;
  for (const std::size_t other : frame.covisible)
    if (partners.size() < NUM_COVISIBLE)
      partners.insert(other);
  std::vector<std::pair<double, std::size_t>> alike;
  for (std::size_t k = 0; k < frames_.size(); ++k)
    if (!partners.count(k))
      alike.emplace_back(-frames_[k].thumbnail.dot(frame.thumbnail), k);
  std::sort(alike.begin(), alike.end());
  for (std::size_t i = 0; i < std::min(NUM_ALIKE, alike.size()); ++i)
    partners.insert(alike[i].second);
  return partners;
}

void
LiveSparseModel::add(NewKeyFrame frame)
{
  const std::size_t node = frames_.size();
  ImageNode added;
  added.timestamp = frame.images.timestamp;
  try {
    added.features = frame.features ? std::move(*frame.features)
                                    : findFeatures(frame.images, graph_.camera(),
                                                   "key frame " + std::to_string(node), options_);
  }
  catch (const pcl::IOException&) { // by the caller's function: geometry alone may register it
  }
  depths_.resize(node + 1);
  depths_.set(node, frame.images.depth);
  views_.push_back(depths_.get(node, model_.calibration(), DepthError::Zero()));
  frame.features.reset();
  frame.images = {};
  features_.push_back(std::make_shared<const Features>(added.features));
  ChosenPairs pairs(partners(frame));
  std::vector<ImageNode> nodes;
  nodes.push_back(std::move(added));
  frames_.push_back(std::move(frame));
  graph_.append(std::move(nodes), false, {}, &pairs);
  model_.resize(graph_.size());
  model_.setMotion(node, frames_[node].motion);
  if (registerFrame(node)) {
    tryAgain();
    adjust();
  }
}

/** By its matches, or, where they do not suffice, by geometry from where tracking left it. */
bool
LiveSparseModel::registerFrame(std::size_t frame)
{
  const TrackOptions& tracks = options_.mapper.tracks;
  if (model_.registeredFrames().empty()) {
    if (frames_[frame].tracked)
      model_.registerFrame(graph_, frame, *frames_[frame].tracked, COMPONENT, tracks);
    return model_.isRegistered(frame);
  }
  NewFrame added{
      frame, registrar_->registeredNeighbours(model_, frame, COMPONENT), {}, options_.num_threads};
  FrameRegistration found;
  if (!added.neighbours.empty())
    found = registrar_->bundleICP(model_, added);
  if (!found.registered && frames_[frame].tracked) {
    added.neighbours.clear();
    for (const std::size_t other : frames_[frame].covisible)
      if (model_.isRegistered(other))
        added.neighbours.push_back({other, 0});
    added.guess = frames_[frame].tracked;
    if (!added.neighbours.empty())
      found = registrar_->bundleICP(model_, added);
  }
  if (!found.registered)
    return false;
  model_.registerFrame(graph_, frame, found.world_from_camera, COMPONENT, tracks);
  model_.setDepthError(frame, found.depth_error);
  BundleAdjustmentOptions local = options_.mapper.adjustment;
  local.max_iterations = ComponentAdjuster::INTERMEDIATE_ITERATIONS;
  adjustLocally(graph_, {frame}, NUM_HELD, local, model_);
  return true;
}

/** Frames that were lost, as long as one more finds its place. */
void
LiveSparseModel::tryAgain()
{
  for (std::size_t k = 0; k < frames_.size(); ++k)
    if (!model_.isRegistered(k) && model_.visibility(graph_, k, COMPONENT) > 0)
      registerFrame(k);
}

/** All key frames, when the model has grown. */
void
LiveSparseModel::adjust()
{
  const double size = double(model_.registeredFrames(COMPONENT).size());
  if (size < next_adjustment_)
    return;
  next_adjustment_ = size * ADJUSTMENT_GROWTH;
  correctFalseConnections(graph_, COMPONENT, options_.mapper.tracks, options_.num_threads, model_);
  if (size >= next_calibration_ && size < LAST_CALIBRATION) {
    next_calibration_ = size * CALIBRATION_GROWTH;
    forgetCalibration();
    adjuster_->calibrate(model_, COMPONENT);
  }
  adjuster_->adjustInBetween(model_, COMPONENT);
  correctViews();
}

/** By the calibration and the errors of depth that an adjustment has found. */
void
LiveSparseModel::correctViews()
{
  parallelFor(views_.size(), options_.num_threads, {}, [this](std::size_t k) {
    views_[k] = depths_.get(k, model_.calibration(), model_.depthError(k));
  });
}

/** Of tracks, else as the frame's own depth says. */
std::vector<Eigen::Vector3f>
LiveSparseModel::pointsOf(std::size_t frame) const
{
  const Features& features = graph_.features(frame);
  std::vector<Eigen::Vector3f> points(
      features.size(), Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  for (std::size_t j = 0; j < features.size(); ++j)
    if (const int point = model_.pointOf(frame, int(j)); point >= 0)
      points[j] = model_.points()[std::size_t(point)].position.cast<float>();
    else if (features.hasDepth(j))
      points[j] = measuredPoint(graph_, model_, {frame, int(j)}).cast<float>();
  return points;
}

std::shared_ptr<const LiveMap>
LiveSparseModel::snapshot() const
{
  auto map = std::make_shared<LiveMap>();
  for (std::size_t k = 0; k < frames_.size(); ++k) {
    map->key_frames.push_back(
        {std::nullopt, model_.depthFromColor(k), views_[k], features_[k], {}});
    if (model_.isRegistered(k)) {
      map->key_frames.back().world_from_camera = model_.worldFromCamera(k);
      map->key_frames.back().points = pointsOf(k);
    }
  }
  map->calibration = model_.calibration();
  map->edges = graph_.numEdges();
  auto points = std::make_shared<pcl::PointCloud<pcl::PointXYZRGB>>();
  for (const ScenePoint& point : model_.points()) {
    if (point.track.empty())
      continue;
    const Observation& first = point.track.front();
    const cv::Vec3b& color = features_[first.frame]->colors[std::size_t(first.feature)];
    pcl::PointXYZRGB colored(color[2], color[1], color[0]);
    colored.getVector3fMap() = point.position.cast<float>();
    points->push_back(colored);
  }
  map->points = points;
  return map;
}

} // namespace bundle_icp
