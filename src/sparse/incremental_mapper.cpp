// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/sparse/incremental_mapper.h>

#include "common/parallel.h"
#include "sparse/frame_motions.h"
#include "sparse/frame_registration.h"
#include "sparse/trajectory_smoothing.h"

#include <pcl/exceptions.h>

#include <algorithm>
#include <numeric>

namespace bundle_icp {
namespace {

/** Rounds of adjustment and outlier removal that end a component. */
constexpr int FINAL_ROUNDS = 2;
/** Iterations of the adjustments in between: the model will change again. */
constexpr int INTERMEDIATE_ITERATIONS = 6;
/** Images that hold a local adjustment in place. */
constexpr std::size_t NUM_HELD = 10;
/** Fewer images do not tell how smoothly the camera moves. */
constexpr std::size_t MIN_FOR_MOTION_PRIOR = 20;

} // namespace

class IncrementalMapper::Impl {
public:
  Impl(const ImageGraph& graph, DepthViewProvider depth_views, const MapperOptions& options)
  : registrations_(graph.size())
  , graph_(graph)
  , depth_views_(std::move(depth_views))
  , options_(withThreads(options))
  , registrar_(graph_, depth_views_, options_)
  , visibility_(graph.size())
  , covariances_(graph.size())
  , num_dense_neighbours_(options.num_dense_neighbours)
  {
  }

  bool
  run(SparseModel& model, const ProgressCallback& progress);

  std::vector<ImageRegistration> registrations_;
  SelfCalibrationResult self_calibration_;

private:
  static MapperOptions
  withThreads(MapperOptions options)
  {
    options.adjustment.num_threads = options.num_threads;
    return options;
  }
  bool
  registerComponents(SparseModel& model);
  void
  numberBySize(SparseModel& model) const;
  bool
  initialise(SparseModel& model, int component);
  bool
  grow(SparseModel& model, int component, bool keys_only);
  std::vector<std::size_t>
  nextImages(const SparseModel& model, bool keys_only) const;
  std::size_t
  registerBatch(SparseModel& model, const std::vector<std::size_t>& batch, int component);
  void
  updateVisibility(const SparseModel& model, std::size_t image, int component);
  void
  findMotions(SparseModel& model, int component) const;
  void
  calibrate(SparseModel& model, int component);
  void
  adjust(SparseModel& model, int component, int max_iterations, bool dense);
  std::vector<RelativePoseTerm>
  denseTerms(const SparseModel& model, const std::vector<std::size_t>& images) const;
  void
  registerByTime(SparseModel& model, int component);
  void
  applyMotionPrior(SparseModel& model, int component) const;
  std::vector<std::size_t>
  byTime(std::vector<std::size_t> images) const;
  bool
  report(const SparseModel& model) const;

  const ImageGraph& graph_;
  const DepthViewProvider depth_views_;
  const MapperOptions options_;
  FrameRegistrar registrar_;
  /** V of equation (4) for the component that grows. */
  std::vector<std::size_t> visibility_;
  std::vector<char> failed_;
  std::vector<Matrix6d> covariances_; ///< of the poses of images that are not key images
  std::size_t num_dense_neighbours_;
  std::vector<RelativePoseTerm> dense_terms_; ///< of the last adjustment
  int calibrated_component_ = -1; ///< the one that the calibration was found in
  ProgressCallback progress_;
};

bool
MapperOptions::isValid(std::string* error) const
{
  std::string reason;
  if (min_visual_inliers < 3)
    reason = "min_visual_inliers must be >= 3";
  else if (max_views < 1 || batch_size < 1)
    reason = "max_views and batch_size must be >= 1";
  else if (!(adjustment_growth > 1))
    reason = "adjustment_growth must be > 1";
  else if (!(min_overlap > 0 && min_overlap <= 1))
    reason = "min_overlap must lie in (0, 1]";
  else if (!visual_start && method != ImageRegistrationMethod::BUNDLE_ICP)
    reason = "only the method BUNDLE_ICP can do without visual_start";
  else if (!(max_position_deviation > 0 && max_rotation_deviation > 0))
    reason = "max_position_deviation and max_rotation_deviation must be > 0";
  else if (!(shared_depth_sigmas > 0))
    reason = "shared_depth_sigmas must be > 0";
  else if (num_threads < 0)
    reason = "num_threads must be >= 0";
  else
    tracks.isValid(&reason) && adjustment.isValid(&reason) && virtual_depth.isValid(&reason) &&
        calibration_test.isValid(&reason) && calibration.isValid(&reason);
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

IncrementalMapper::IncrementalMapper(const ImageGraph& graph,
                                     DepthViewProvider depth_views,
                                     const MapperOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw pcl::BadArgumentException("IncrementalMapper: " + error);
  impl_ = std::make_unique<Impl>(graph, std::move(depth_views), options);
}

IncrementalMapper::~IncrementalMapper() = default;

bool
IncrementalMapper::run(SparseModel& model, const ProgressCallback& progress)
{
  return impl_->run(model, progress);
}

const SelfCalibrationResult&
IncrementalMapper::selfCalibration() const
{
  return impl_->self_calibration_;
}

const std::vector<ImageRegistration>&
IncrementalMapper::registrations() const
{
  return impl_->registrations_;
}

bool
IncrementalMapper::Impl::run(SparseModel& model, const ProgressCallback& progress)
{
  progress_ = progress;
  model.resize(graph_.size());
  model.setCalibration(options_.calibration);
  model.setDepthNoise(options_.virtual_depth.noise);
  for (std::size_t i = 0; i < graph_.size(); ++i)
    registrations_[i].reason = graph_.exclusion(i);
  const bool completed = registerComponents(model);
  numberBySize(model);
  return completed;
}

bool
IncrementalMapper::Impl::registerComponents(SparseModel& model)
{
  for (int component = 0; initialise(model, component); ++component) {
    if (!grow(model, component, true))
      return false;
    calibrate(model, component);
    adjust(model, component, options_.adjustment.max_iterations, true);
    // Images that only look like others: registered against the finished model
    if (!grow(model, component, false))
      return false;
    registerByTime(model, component);
    applyMotionPrior(model, component);
  }
  return true;
}

/** Components grow in the order of their best connected image, which is not that of their size. */
void
IncrementalMapper::Impl::numberBySize(SparseModel& model) const
{
  std::vector<std::vector<std::size_t>> components;
  for (int component = 0; !model.registeredImages(component).empty(); ++component)
    components.push_back(model.registeredImages(component));
  std::stable_sort(components.begin(), components.end(), [](const auto& a, const auto& b) {
    return a.size() > b.size();
  });
  for (std::size_t c = 0; c < components.size(); ++c)
    for (const std::size_t image : components[c])
      model.registerImage(image, model.worldFromCamera(image), int(c));
}

bool
IncrementalMapper::Impl::report(const SparseModel& model) const
{
  return !progress_ || progress_({"registration", model.registeredImages().size(), graph_.size()});
}

/** First pair: the strongest edge of the image with the highest Cor. */
bool
IncrementalMapper::Impl::initialise(SparseModel& model, int component)
{
  const auto is_free = [&](std::size_t i) {
    return !model.isRegistered(i) && graph_.isKey(i) && graph_.exclusion(i).empty();
  };
  std::vector<std::size_t> seeds;
  for (std::size_t i = 0; i < graph_.size(); ++i)
    if (is_free(i))
      seeds.push_back(i);
  std::stable_sort(seeds.begin(), seeds.end(), [this](std::size_t a, std::size_t b) {
    return graph_.correspondences(a) > graph_.correspondences(b);
  });
  for (const std::size_t seed : seeds) {
    ImageEdge strongest;
    for (const ImageEdge& edge : graph_.edges(seed))
      if (is_free(edge.neighbour) &&
          (!strongest.pair || edge.pair->matches.size() > strongest.pair->matches.size()))
        strongest = edge;
    if (!strongest.pair)
      continue;
    model.registerImage(graph_, seed, Pose::Identity(), component, options_.tracks);
    const FrameRegistration second =
        registrar_.registerFrame(model, strongest.neighbour, component, options_.num_threads);
    if (!second.report.registered) {
      model.registerImage(seed, Pose::Identity(), -1);
      continue;
    }
    registrations_[seed] = registrations_[strongest.neighbour] = second.report;
    model.registerImage(
        graph_, strongest.neighbour, second.world_from_camera, component, options_.tracks);
    for (std::size_t i = 0; i < graph_.size(); ++i)
      visibility_[i] = 0;
    updateVisibility(model, seed, component);
    updateVisibility(model, strongest.neighbour, component);
    return true;
  }
  return false;
}

/** Registering an image changes the visibility of those that it shares an edge with. */
void
IncrementalMapper::Impl::updateVisibility(const SparseModel& model,
                                          std::size_t image,
                                          int component)
{
  for (const ImageEdge& edge : graph_.edges(image))
    if (!model.isRegistered(edge.neighbour))
      visibility_[edge.neighbour] = model.visibility(graph_, edge.neighbour, component);
}

/** The images of highest visibility, best first, at most a batch. */
std::vector<std::size_t>
IncrementalMapper::Impl::nextImages(const SparseModel& model, bool keys_only) const
{
  std::vector<std::size_t> images;
  for (std::size_t i = 0; i < graph_.size(); ++i)
    if (!model.isRegistered(i) && !failed_[i] && visibility_[i] > 0 &&
        (!keys_only || graph_.isKey(i)) && graph_.exclusion(i).empty())
      images.push_back(i);
  std::stable_sort(images.begin(), images.end(), [this](std::size_t a, std::size_t b) {
    return visibility_[a] > visibility_[b];
  });
  std::size_t count = std::min(options_.batch_size, images.size());
  // An image that is much better connected should not wait for the others' failures, nor they
  // be tried before it has extended the model.
  while (count > 1 && 2 * visibility_[images[count - 1]] < visibility_[images[0]])
    --count;
  images.resize(count);
  return images;
}

std::size_t
IncrementalMapper::Impl::registerBatch(SparseModel& model,
                                       const std::vector<std::size_t>& batch,
                                       int component)
{
  std::vector<FrameRegistration> slots(batch.size());
  const int inner = batch.size() == 1 ? options_.num_threads : 1;
  parallelFor(batch.size(), options_.num_threads, {}, [&](std::size_t k) {
    slots[k] = registrar_.registerFrame(model, batch[k], component, inner);
  });
  std::size_t registered = 0;
  std::vector<std::size_t> keys;
  for (std::size_t k = 0; k < batch.size(); ++k) {
    registrations_[batch[k]] = slots[k].report;
    if (!slots[k].report.registered) {
      failed_[batch[k]] = 1;
      continue;
    }
    ++registered;
    if (graph_.isKey(batch[k])) {
      model.registerImage(
          graph_, batch[k], slots[k].world_from_camera, component, options_.tracks);
      keys.push_back(batch[k]);
    }
    else
      model.registerImage(batch[k], slots[k].world_from_camera, component);
    covariances_[batch[k]] = slots[k].covariance;
    model.setDepthError(batch[k], slots[k].depth_error);
    updateVisibility(model, batch[k], component);
  }
  BundleAdjustmentOptions local = options_.adjustment;
  local.max_iterations = INTERMEDIATE_ITERATIONS;
  adjustLocally(graph_, keys, NUM_HELD, local, model);
  return registered;
}

/** Adds images by visibility until none is left that can be added. */
bool
IncrementalMapper::Impl::grow(SparseModel& model, int component, bool keys_only)
{
  failed_.assign(graph_.size(), 0);
  double next_adjustment = 8;
  std::size_t size = model.registeredImages(component).size(), size_at_failure = size;
  while (true) {
    const std::vector<std::size_t> batch = nextImages(model, keys_only);
    if (batch.empty()) {
      // Put back and tried again, once the model has grown
      if (size == size_at_failure)
        return true;
      size_at_failure = size;
      failed_.assign(graph_.size(), 0);
      continue;
    }
    size += registerBatch(model, batch, component);
    if (!report(model))
      return false;
    if (keys_only && double(size) >= next_adjustment) {
      adjust(model, component, INTERMEDIATE_ITERATIONS, false);
      next_adjustment = double(size) * options_.adjustment_growth;
    }
  }
}

std::vector<RelativePoseTerm>
IncrementalMapper::Impl::denseTerms(const SparseModel& model,
                                    const std::vector<std::size_t>& images) const
{
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const std::size_t image : images) {
    std::size_t count = 0;
    for (const Neighbour& neighbour :
         registrar_.registeredNeighbours(model, image, model.component(image))) {
      if (count == num_dense_neighbours_)
        break;
      if (!graph_.isKey(neighbour.image))
        continue;
      ++count;
      pairs.emplace_back(std::min(image, neighbour.image), std::max(image, neighbour.image));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  std::vector<std::optional<RelativePoseTerm>> slots(pairs.size());
  parallelFor(pairs.size(), options_.num_threads, {}, [&](std::size_t k) {
    slots[k] = registrar_.registerPair(model, pairs[k].first, pairs[k].second);
  });
  std::vector<RelativePoseTerm> terms;
  for (const auto& slot : slots)
    if (slot)
      terms.push_back(*slot);
  return terms;
}

/** Motions from the poses of all images, of those that are not registered yet from their visual
 *  poses: key images alone are too far apart in time. */
void
IncrementalMapper::Impl::findMotions(SparseModel& model, int component) const
{
  SparseModel placed = model;
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < graph_.size(); ++i)
    if (!model.isRegistered(i) && visibility_[i] > 0 && graph_.exclusion(i).empty())
      others.push_back(i);
  std::vector<FrameRegistration> slots(others.size());
  parallelFor(others.size(), options_.num_threads, {}, [&](std::size_t k) {
    slots[k] = registrar_.registerVisually(model, others[k], component);
  });
  for (std::size_t k = 0; k < others.size(); ++k)
    if (slots[k].report.registered)
      placed.registerImage(others[k], slots[k].world_from_camera, component);
  estimateMotions(graph_, component, placed);
  for (const std::size_t image : placed.registeredImages(component))
    model.setMotion(image, placed.motion(image));
}

/** Self-calibration, in the first component that is large enough for it. */
void
IncrementalMapper::Impl::calibrate(SparseModel& model, int component)
{
  std::vector<std::size_t> keys;
  for (const std::size_t image : model.registeredImages(component))
    if (graph_.isKey(image))
      keys.push_back(image);
  const bool moving = model.calibration()[CalibrationParameter::READOUT] != 0 ||
                      model.calibration()[CalibrationParameter::TIME_OFFSET] != 0;
  const bool tests = options_.self_calibration && calibrated_component_ < 0 &&
                     keys.size() >= options_.calibration_test.min_images;
  if (!moving && !tests)
    return;
  adjust(model, component, INTERMEDIATE_ITERATIONS, false);
  findMotions(model, component);
  if (!tests)
    return;
  SelfCalibrationOptions test = options_.calibration_test;
  test.num_threads = options_.num_threads;
  self_calibration_ = selfCalibrate(graph_, keys, options_.adjustment, test, model);
  if (options_.calibration_test.depth_errors) {
    registrar_.setDepthErrors(self_calibration_.depth_errors);
    if (!self_calibration_.depth_errors && options_.num_dense_neighbours > 0)
      num_dense_neighbours_ = options_.num_exact_dense_neighbours;
  }
  calibrated_component_ = component;
}

/** Global bundle adjustment over the key images of a component; `dense` makes it the final
 *  one, with all evidence and outliers removed in between. */
void
IncrementalMapper::Impl::adjust(SparseModel& model, int component, int max_iterations, bool dense)
{
  BundleAdjustmentProblem problem;
  for (const std::size_t image : model.registeredImages(component))
    if (graph_.isKey(image))
      problem.variable.push_back(image);
  BundleAdjustmentOptions options = options_.adjustment;
  options.max_iterations = max_iterations;
  problem.depth_errors = self_calibration_.depth_errors;
  if (component == calibrated_component_)
    problem.calibrated = self_calibration_.calibrated;
  const int rounds = !options_.global_adjustment ? 0 : dense ? FINAL_ROUNDS : 1;
  dense_terms_.clear();
  for (int round = 0; round < rounds; ++round) {
    if (dense && round > 0 && num_dense_neighbours_ > 0)
      dense_terms_ = denseTerms(model, problem.variable);
    problem.relative_poses = dense_terms_;
    adjustBundle(graph_, problem, options, model);
    model.removeOutliers(graph_, options_.tracks);
    if (dense)
      for (const std::size_t image : problem.variable)
        model.extendTracks(graph_, image, options_.tracks);
  }
  for (std::size_t i = 0; i < graph_.size(); ++i)
    if (!model.isRegistered(i))
      visibility_[i] = model.visibility(graph_, i, component);
}

/** Images without visual evidence start from their neighbours in time and let geometry
 *  decide. */
void
IncrementalMapper::Impl::registerByTime(SparseModel& model, int component)
{
  if (!options_.ordered_in_time || options_.method != ImageRegistrationMethod::BUNDLE_ICP)
    return;
  std::vector<std::size_t> all(graph_.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<std::size_t> by_time = byTime(std::move(all));
  const auto visit = [&](const std::vector<std::size_t>& order) {
    for (std::size_t k = 1; k < order.size(); ++k) {
      const std::size_t image = order[k], last = order[k - 1];
      if (model.isRegistered(image) || model.component(last) != component ||
          registrations_[image].reason.rfind("blurred", 0) == 0)
        continue;
      // Constant velocity, when the neighbour before is known too
      Pose guess = model.worldFromCamera(last);
      std::vector<Neighbour> neighbours{{last, 0}};
      if (k >= 2 && model.component(order[k - 2]) == component) {
        const double step = graph_.timestamp(last) - graph_.timestamp(order[k - 2]);
        const double ahead = graph_.timestamp(image) - graph_.timestamp(last);
        const Pose motion =
            model.worldFromCamera(order[k - 2]).inverse() * model.worldFromCamera(last);
        if (step != 0 && std::abs(ahead / step) < 3)
          guess = guess * increment(ahead / step * logarithm(motion));
        neighbours.push_back({order[k - 2], 0});
      }
      const FrameRegistration registration = registrar_.registerFrameByGeometry(
          model, image, neighbours, guess, options_.num_threads);
      registrations_[image] = registration.report;
      covariances_[image] = registration.covariance;
      if (registration.report.registered)
        model.registerImage(image, registration.world_from_camera, component);
    }
  };
  visit(by_time);
  std::reverse(by_time.begin(), by_time.end());
  visit(by_time);
}

std::vector<std::size_t>
IncrementalMapper::Impl::byTime(std::vector<std::size_t> images) const
{
  std::stable_sort(images.begin(), images.end(), [this](std::size_t a, std::size_t b) {
    return graph_.timestamp(a) < graph_.timestamp(b);
  });
  return images;
}

/** Each image was registered on its own, and the errors of neighbours in time are independent;
 *  the motion between them is not. */
void
IncrementalMapper::Impl::applyMotionPrior(SparseModel& model, int component) const
{
  if (!options_.motion_prior || !options_.ordered_in_time)
    return;
  const std::vector<std::size_t> images = byTime(model.registeredImages(component));
  if (images.size() < MIN_FOR_MOTION_PRIOR)
    return;
  std::vector<PoseMeasurement> measurements(images.size());
  parallelFor(images.size(), options_.num_threads, {}, [&](std::size_t k) {
    const bool is_adjusted = graph_.isKey(images[k]) && !registrations_[images[k]].by_geometry;
    measurements[k] = {graph_.timestamp(images[k]),
                       model.worldFromCamera(images[k]),
                       is_adjusted ? registrar_.poseCovariance(model, images[k], dense_terms_)
                                   : covariances_[images[k]]};
  });
  const std::vector<Pose> poses =
      smoothTrajectory(measurements, estimateMotionPrior(measurements));
  for (std::size_t k = 0; k < images.size(); ++k)
    model.setWorldFromCamera(images[k], poses[k]);
}

} // namespace bundle_icp
