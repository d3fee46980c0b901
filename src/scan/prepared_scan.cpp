// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/prepared_scan.h"

#include "common/free_memory.h"
#include "common/parallel.h"
#include "io/text_file.h"
#include "scan/find_features.h"
#include "scan/settings_hash.h"

#include <bundle_icp/scan/check.h>

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/io/joined_dataset.h>

#include <algorithm>
#include <chrono>

namespace bundle_icp {
namespace {

/** FNV-1a over positions and depths: frames get an order that follows from their
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

/** Parts of max_memory that go to descriptors, to those that are matched at once, and to depth. The
 *  other five are for what no file can hold. */
constexpr std::size_t MEMORY_PARTS = 8;

/** With the memory that is free now, where none is given. */
ReconstructionOptions
withMemory(ReconstructionOptions options)
{
  if (options.max_memory == 0)
    options.max_memory = freeMemory() / 2;
  options.graph.matching.max_memory = std::max<std::size_t>(options.max_memory / MEMORY_PARTS, 1);
  return options;
}

void
check(const RGBDDataset& dataset, const ReconstructionOptions& options)
{
  std::string error;
  if (!options.isValid(&error) || !dataset.camera().isValid(&error))
    throw BadArgumentException("reconstruct: " + error);
  if (dataset.camera().hasDistortion())
    throw BadArgumentException("reconstruct: the camera of the frames has distortion; "
                               "RGBDDataset::read() must give undistorted images");
  if (dataset.size() == 0)
    throw BadArgumentException("reconstruct: the dataset has no frames");
  for (std::size_t i = 0; i < dataset.size(); ++i)
    if (const auto prior = dataset.prior(i); prior && !prior->isValid(&error))
      throw BadArgumentException("reconstruct: " + dataset.name(i) + ": " + error);
}

/** What is wrong with a recording, or with each of several that are joined. */
std::vector<Finding>
checkParts(const RGBDDataset& dataset, const CheckOptions& options)
{
  const auto* const joined = dynamic_cast<const JoinedDataset*>(&dataset);
  if (!joined)
    return checkRecording(dataset, options);
  std::vector<Finding> findings = joined->ownFindings();
  for (const RGBDDataset::Ptr& recording : joined->recordings())
    for (Finding finding : checkRecording(*recording, options)) {
      finding.what = recording->recording(0) + ": " + finding.what;
      findings.push_back(finding);
    }
  return findings;
}

} // namespace

PreparedScan::Impl::Impl(const RGBDDataset& dataset, const ReconstructionOptions& options)
: dataset_(dataset), options_(withMemory(options)), frames_(dataset.size()),
  descriptors_(options_.max_memory / MEMORY_PARTS, options.temporary_folder),
  depth_views_(dataset.camera(), options.depth_reduction, options.mapper.registration.virtual_depth,
               options_.max_memory / MEMORY_PARTS, options.temporary_folder)
{
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    frames_[i].id = dataset.id(i);
    frames_[i].timestamp = dataset.timestamp(i);
    frames_[i].name = dataset.name(i);
  }
  // What the caller's own function gives may change without a sign.
  const bool needs_features =
      !options.poses && options.method != ReconstructionMethod::F2M_ICP && !options.find_features;
  if (options.database && needs_features)
    stored_ = std::make_unique<StoredFrames>(dataset, options);
}

template <class Body>
bool
PreparedScan::Impl::runOnce(const char* name, Stage& stage, Timing& timing, const Body& body)
{
  if (!stage.was_run) {
    const auto start = std::chrono::steady_clock::now();
    stage.completed = body();
    stage.was_run = true;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    stage.seconds = elapsed.count();
  }
  timing.emplace_back(name, stage.seconds);
  return stage.completed;
}

const std::vector<Finding>&
PreparedScan::Impl::needCheck(Timing& timing)
{
  runOnce("check", check_stage_, timing, [this] {
    CheckOptions check;
    check.num_threads = options_.num_threads;
    check_findings_ = checkParts(dataset_.unfiltered(), check);
    findStaying();
    return true;
  });
  return check_findings_;
}

bool
PreparedScan::Impl::needFeatures(const ProgressCallback& progress, Timing& timing)
{
  return runOnce("features", features_stage_, timing, [&] { return extractAll(progress); });
}

bool
PreparedScan::Impl::needGraph(const ProgressCallback& progress, Timing& timing)
{
  return runOnce("matching", graph_stage_, timing, [&] { return buildGraph(progress); });
}

/** Whatever does not move as the wanted part does loses its depth. */
void
PreparedScan::Impl::findStaying()
{
  staying_ = findStayingPixels(dataset_, options_.num_threads);
  if (!staying_.cameraStandsStill())
    dataset_.setMask([mask = staying_.staysWithCamera()](const RGBDFrame&) { return mask; });
  else if (options_.moving == MovingPart::OBJECT)
    dataset_.setMask([this](const RGBDFrame& frame) { return staying_.surroundingsIn(frame); });
  else if (staying_.moving_frames > 0)
    dataset_.setMask([this](const RGBDFrame& frame) { return staying_.movingIn(frame); });
}

/** A frame that cannot be read, or whose features fail, is left out; a database that fails ends the
 *  run. */
void
PreparedScan::Impl::extract(std::size_t i)
{
  const auto succeeds = [this, i](const auto& step) {
    try {
      step();
      return true;
    }
    catch (const pcl::IOException& error) {
      frames_[i].reason = error.what();
      return false;
    }
  };
  RGBDFrame rgbd;
  if (!succeeds([&] { rgbd = dataset_.read(i); }))
    return;
  std::optional<Features> features = stored_ ? stored_->features(i, rgbd) : std::nullopt;
  if (!features) {
    if (!succeeds(
            [&] { features = findFeatures(rgbd, dataset_.camera(), frames_[i].name, options_); }))
      return;
    if (stored_)
      stored_->addFeatures(i, *features);
  }
  frames_[i].features = features->size();
  features->descriptors = descriptors_.keep(features->descriptors);
  nodes_[i] = {std::move(*features), frames_[i].timestamp, dataset_.prior(i)};
  depth_views_.set(i, rgbd.depth);
}

bool
PreparedScan::Impl::extractAll(const ProgressCallback& progress)
{
  depth_views_.resize(dataset_.size());
  nodes_.resize(dataset_.size());
  const bool completed = parallelFor(dataset_.size(), options_.num_threads, {"features", progress},
                                     [this](std::size_t i) { extract(i); });
  if (stored_) {
    stored_->commit();
    reused_ = stored_->reused();
  }
  returnMemory();
  return completed;
}

bool
PreparedScan::Impl::buildGraph(const ProgressCallback& progress)
{
  std::vector<std::pair<std::uint64_t, std::size_t>> order; // content, frame
  for (std::size_t i = 0; i < frames_.size(); ++i)
    if (frames_[i].reason.empty())
      order.emplace_back(contentHash(nodes_[i].features), i);
  std::sort(order.begin(), order.end());
  std::vector<ImageNode> nodes;
  node_of_frame_.resize(frames_.size());
  for (const auto& [content, frame] : order) {
    node_of_frame_[frame] = nodes.size();
    frame_of_node_.push_back(frame);
    nodes.push_back(std::move(nodes_[frame]));
  }
  graph_ = std::make_shared<ImageGraph>(dataset_.camera(), options_.graph);
  if (stored_)
    stored_->setNodes(frame_of_node_);
  const bool completed =
      graph_->append(std::move(nodes), dataset_.isOrdered(), progress, stored_.get());
  if (stored_) {
    stored_->commit();
    reused_ = stored_->reused();
  }
  return completed;
}

std::unique_ptr<StoredMap>
PreparedScan::Impl::storedMap(const MapperOptions& mapper) const
{
  if (!stored_)
    return nullptr;
  return stored_->map(*graph_, settingsHash(options_.graph, mapper, options_.depth_reduction,
                                            options_.mapper.registration.virtual_depth));
}

const Features&
PreparedScan::Impl::features(std::size_t frame) const
{
  const bool in_graph = graph_ && frames_[frame].reason.empty();
  return in_graph ? graph_->features(node_of_frame_[frame]) : nodes_[frame].features;
}

void
PreparedScan::Impl::releaseDescriptors(bool keep_key_frames)
{
  nodes_.clear();
  if (graph_)
    graph_->releaseDescriptors(keep_key_frames);
  returnMemory();
}

void
PreparedScan::Impl::releaseDepth()
{
  depth_views_.clear();
  returnMemory();
}

PreparedScan::PreparedScan(const RGBDDataset& dataset, const ReconstructionOptions& options)
{
  check(dataset, options);
  impl_ = std::make_unique<Impl>(dataset, options.withThreads());
}

PreparedScan::~PreparedScan() = default;

} // namespace bundle_icp
