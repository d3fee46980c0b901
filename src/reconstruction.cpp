// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/reconstruction.h>

#include "common/parallel.h"
#include "depth_view_store.h"

#include <bundle_icp/surface/tsdf_marching_cubes.h>

#include <pcl/exceptions.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <numeric>

namespace bundle_icp {
namespace {

/** Frames that are decoded at once before they are fused one after the other. */
constexpr std::size_t DECODE_AHEAD = 8;

/** What is known of a frame before it enters the graph. */
struct PreparedFrame {
  ImageNode node;
  std::string error;          ///< why it cannot be read
  std::uint64_t content = 0;  ///< hash of what it shows
};

/** FNV-1a over positions and descriptors: images get an order that follows from their
 *  content, so that a shuffled recording takes the very same path. */
std::uint64_t
contentHash(const Features& features)
{
  std::uint64_t hash = 14695981039346656037ull;
  const auto add = [&hash](const void* data, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i)
      hash = (hash ^ static_cast<const std::uint8_t*>(data)[i]) * 1099511628211ull;
  };
  add(features.pixels.data(), features.pixels.size() * sizeof(features.pixels[0]));
  add(features.depths.data(), features.depths.size() * sizeof(features.depths[0]));
  return hash;
}

/** One run of reconstruct(): its stages in order. */
class Reconstruction {
public:
  Reconstruction(const RGBDDataset& dataset,
                 const ReconstructionOptions& options,
                 const ProgressCallback& progress);

  ReconstructionResult
  run();

private:
  RGBDFrame
  readScaled(std::size_t index) const;
  bool
  prepareFrames();
  bool
  buildGraph();
  bool
  mapImages();
  bool
  fuseSurface();
  void
  chooseWorld();
  void
  reportFrames(const std::vector<ImageRegistration>& registrations);
  template <class Stage>
  bool
  timed(const char* name, const Stage& stage);

  const RGBDDataset& dataset_;
  ReconstructionOptions options_;
  ProgressCallback progress_;
  std::vector<PreparedFrame> prepared_;
  std::vector<std::size_t> image_of_frame_;
  std::shared_ptr<ImageGraph> graph_;
  DepthViewStore depth_views_;
  ReconstructionResult result_;
};

/** One number of threads steers all steps. */
ReconstructionOptions
withThreads(ReconstructionOptions options)
{
  options.graph.matching.num_threads = options.num_threads;
  options.graph.retrieval.num_threads = options.num_threads;
  options.mapper.num_threads = options.num_threads;
  options.volume.num_threads = options.num_threads;
  options.mesh.num_threads = options.num_threads;
  return options;
}

Reconstruction::Reconstruction(const RGBDDataset& dataset,
                               const ReconstructionOptions& options,
                               const ProgressCallback& progress)
: dataset_(dataset)
, options_(withThreads(options))
, progress_(progress)
, prepared_(dataset.size())
, depth_views_(dataset.camera(), options.depth_reduction, options.mapper.virtual_depth)
{
  options_.mapper.ordered_in_time = dataset.isOrdered();
}

template <class Stage>
bool
Reconstruction::timed(const char* name, const Stage& stage)
{
  const auto start = std::chrono::steady_clock::now();
  const bool completed = stage();
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  result_.timing_s.emplace_back(name, seconds.count());
  return completed;
}

ReconstructionResult
Reconstruction::run()
{
  result_.frames.resize(dataset_.size());
  const bool completed = timed("features", [this] { return prepareFrames(); }) &&
                         timed("matching", [this] { return buildGraph(); }) &&
                         timed("registration", [this] { return mapImages(); }) &&
                         (!options_.make_mesh || result_.component_sizes.empty() ||
                          timed("surface", [this] { return fuseSurface(); }));
  result_.status = !completed                         ? ReconstructionStatus::STOPPED
                   : result_.component_sizes.empty() ? ReconstructionStatus::NOTHING_REGISTERED
                                                     : ReconstructionStatus::COMPLETED;
  for (FrameReport& frame : result_.frames)
    if (!completed && !frame.registered && frame.reason.empty())
      frame.reason = "the run was stopped before";
  result_.graph = graph_;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  result_.peak_memory_bytes = std::size_t(usage.ru_maxrss) * 1024;
  return std::move(result_);
}

/** A frame with the depth scale that is known from elsewhere. */
RGBDFrame
Reconstruction::readScaled(std::size_t index) const
{
  RGBDFrame frame = dataset_.read(index);
  if (options_.mapper.calibration.depth_scale != 1)
    frame.depth = frame.depth * options_.mapper.calibration.depth_scale;
  return frame;
}

/** Equation (2): features with depth; and the depth that Bundle ICP will need. */
bool
Reconstruction::prepareFrames()
{
  depth_views_.resize(dataset_.size());
  const LoopProgress report{"features", progress_};
  return parallelFor(dataset_.size(), options_.num_threads, report, [this](std::size_t i) {
    FrameReport& frame = result_.frames[i];
    frame.id = dataset_.id(i);
    frame.timestamp = dataset_.timestamp(i);
    frame.name = dataset_.name(i);
    PreparedFrame& prepared = prepared_[i];
    try {
      const RGBDFrame image = readScaled(i);
      prepared.node.features = extractFeatures(image, dataset_.camera(), options_.features);
      prepared.node.timestamp = frame.timestamp;
      prepared.content = contentHash(prepared.node.features);
      depth_views_.set(i, image.depth);
    }
    catch (const pcl::IOException& error) {
      prepared.error = error.what();
    }
  });
}

/** Equations (3) to (5): the readable frames, in the order of their content, become nodes. */
bool
Reconstruction::buildGraph()
{
  std::vector<std::size_t>& order = result_.frame_of_image;
  for (std::size_t i = 0; i < prepared_.size(); ++i) {
    result_.frames[i].reason = prepared_[i].error;
    if (prepared_[i].error.empty())
      order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
    return prepared_[a].content < prepared_[b].content;
  });
  std::vector<ImageNode> nodes;
  for (const std::size_t frame : order) {
    result_.frames[frame].features = prepared_[frame].node.features.size();
    nodes.push_back(std::move(prepared_[frame].node));
  }
  prepared_.clear();
  graph_ = std::make_shared<ImageGraph>(dataset_.camera(), options_.graph);
  return graph_->append(std::move(nodes), dataset_.isOrdered(), progress_);
}

bool
Reconstruction::mapImages()
{
  const auto depth_of_image = [this](std::size_t image, const SparseModel& model) {
    return depth_views_.get(
        result_.frame_of_image[image], model.calibration(), model.depthError(image));
  };
  IncrementalMapper mapper(*graph_, depth_of_image, options_.mapper);
  const bool completed = mapper.run(result_.model, progress_);
  result_.self_calibration = mapper.selfCalibration();
  chooseWorld();
  reportFrames(mapper.registrations());
  return completed;
}

/** The world is the camera of the earliest registered frame, however the run began. */
void
Reconstruction::chooseWorld()
{
  SparseModel& model = result_.model;
  for (int component = 0;; ++component) {
    const std::vector<std::size_t> images = model.registeredImages(component);
    if (images.empty())
      break;
    result_.component_sizes.push_back(images.size());
    const std::size_t first =
        *std::min_element(images.begin(), images.end(), [this](std::size_t a, std::size_t b) {
          return graph_->timestamp(a) < graph_->timestamp(b);
        });
    model.transform(component, model.worldFromCamera(first).inverse());
    model.setWorldFromCamera(first, Pose::Identity());
  }
}

void
Reconstruction::reportFrames(const std::vector<ImageRegistration>& registrations)
{
  for (std::size_t image = 0; image < registrations.size(); ++image) {
    FrameReport& frame = result_.frames[result_.frame_of_image[image]];
    const ImageRegistration& registration = registrations[image];
    frame.registered = result_.model.isRegistered(image);
    frame.component = result_.model.component(image);
    frame.reason = frame.registered ? "" : registration.reason;
    if (!frame.registered && frame.reason.empty())
      frame.reason = "no registered frame shares enough matches with it";
    frame.matches = registration.matches;
    frame.inliers = registration.inliers;
    frame.icp_rmse = registration.icp_rmse;
    frame.by_geometry = registration.by_geometry;
    if (frame.registered)
      frame.world_from_camera = result_.model.worldFromCamera(image);
    frame.depth_error = result_.model.depthError(image);
  }
}

/** Equation (7): all frames of the largest component, decoded ahead, fused in the order of their
 *  content, which a shuffled recording shares. */
bool
Reconstruction::fuseSurface()
{
  std::vector<std::size_t> fused; // images
  for (std::size_t image = 0; image < result_.frame_of_image.size(); ++image)
    if (result_.model.component(image) == 0)
      fused.push_back(image);
  const SparseModel& model = result_.model;
  const CameraIntrinsics camera = model.calibration().corrected(dataset_.camera());
  auto volume = std::make_shared<TSDFVolume>(options_.volume);
  for (std::size_t begin = 0; begin < fused.size(); begin += DECODE_AHEAD) {
    const std::size_t count = std::min(DECODE_AHEAD, fused.size() - begin);
    std::vector<RGBDFrame> frames(count);
    parallelFor(count, options_.num_threads, {}, [&](std::size_t k) {
      const std::size_t image = fused[begin + k], frame = result_.frame_of_image[image];
      try {
        frames[k] = correctedFrame(readScaled(frame),
                                   dataset_.camera(),
                                   model.calibration(),
                                   model.depthError(image),
                                   model.depthNoise());
      }
      catch (const pcl::IOException& error) {
        // It could be read before: its pose stays, the surface does without it.
        result_.frames[frame].reason = error.what();
      }
    });
    for (std::size_t k = 0; k < count; ++k)
      if (!frames[k].depth.empty())
        volume->integrate(frames[k], camera, model.worldFromDepth(fused[begin + k]));
    if (progress_ && !progress_({"surface", begin + count, fused.size()}))
      return false;
  }
  TSDFMarchingCubes<pcl::PointXYZRGBNormal> cubes;
  cubes.setVolume(volume);
  cubes.setMeshOptions(options_.mesh);
  cubes.reconstruct(result_.mesh);
  return true;
}

} // namespace

bool
ReconstructionOptions::isValid(std::string* error) const
{
  std::string reason;
  if (depth_reduction < 1 || depth_reduction > 8)
    reason = "depth_reduction must lie in 1 ... 8";
  else if (num_threads < 0)
    reason = "num_threads must be >= 0";
  else
    features.isValid(&reason) && graph.isValid(&reason) && mapper.isValid(&reason) &&
        volume.isValid(&reason) && mesh.isValid(&reason);
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

Trajectory
ReconstructionResult::trajectory(int component) const
{
  Trajectory trajectory;
  for (const FrameReport& frame : frames)
    if (frame.registered && frame.component == component)
      trajectory.push_back({frame.timestamp, frame.world_from_camera});
  std::stable_sort(trajectory.begin(), trajectory.end(), [](const TimedPose& a, const TimedPose& b) {
    return a.timestamp < b.timestamp;
  });
  return trajectory;
}

ReconstructionResult
reconstruct(const RGBDDataset& dataset,
            const ReconstructionOptions& options,
            const ProgressCallback& progress)
{
  std::string error;
  if (!options.isValid(&error) || !dataset.camera().isValid(&error))
    throw pcl::BadArgumentException("reconstruct: " + error);
  if (dataset.size() == 0)
    throw pcl::BadArgumentException("reconstruct: the dataset has no frames");
  return Reconstruction(dataset, options, progress).run();
}

} // namespace bundle_icp
