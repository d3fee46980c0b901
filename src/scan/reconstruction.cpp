// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/reconstruction.h>

#include "common/array_store.h"
#include "refinement/moving_pixels.h"
#include "scan/given_poses.h"
#include "scan/next_views.h"
#include "scan/pose_prior_findings.h"
#include "scan/prepared_scan.h"
#include "scan/read_in_order.h"
#include "scan/result_findings.h"
#include "scan/result_frames.h"
#include "scan/scan_surface.h"

#include <bundle_icp/common/exceptions.h>

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <numeric>

namespace bundle_icp {
namespace {

bool
isTracking(ReconstructionMethod method)
{
  return method == ReconstructionMethod::F2M_ICP || method == ReconstructionMethod::VISUAL_ICP;
}

/** The mapper's options for a method. */
MapperOptions
mapperOptions(const ReconstructionOptions& options, bool ordered_in_time)
{
  MapperOptions mapper = options.mapper;
  mapper.schedule.ordered_in_time = ordered_in_time;
  mapper.refinement.self_calibration &= options.method == ReconstructionMethod::BUNDLE_ICP;
  // A thing fills a small part of the image at one distance: what fits it need not fit the camera.
  mapper.refinement.calibration_test.camera &= options.moving == MovingPart::CAMERA;
  if (options.method == ReconstructionMethod::RGBD_SFM) {
    mapper.registration.method = FrameRegistrationMethod::PNP;
    mapper.registration.visual_start = true;
    mapper.refinement.num_dense_neighbours = 0;
    mapper.refinement.motion_prior = false;
    mapper.refinement.pose_prior = false;
    mapper.refinement.join_by_geometry = false;
  }
  return mapper;
}

} // namespace

/** One run of reconstruct(): its stages in order. */
class Reconstruction {
public:
  /** \param is_last whether no other reconstruction of the scan follows. */
  Reconstruction(PreparedScan& scan, const ReconstructionOptions& options,
                 const ProgressCallback& progress, bool is_last)
  : scan_(*scan.impl_), options_(options.withThreads()), progress_(progress), is_last_(is_last)
  {
    if (options.moving != scan_.options().moving)
      throw BadArgumentException("reconstruct: the scan was prepared for another moving part");
    if (options.poses)
      checkTimes(*options.poses, scan_.dataset());
  }

  ReconstructionResult
  run();

private:
  bool
  prepare();
  bool
  estimatePoses();
  bool
  usePoses();
  bool
  trackFrames();
  bool
  trackFrame(FrameToModelTracker& tracker, std::size_t index, const RGBDFrame& rgbd);
  bool
  mapFrames();
  void
  verify();
  bool
  makeSurface();
  bool
  suggestNext();
  void
  addFindings(const std::vector<Finding>& findings);
  void
  reportFrames(const std::vector<FrameRegistration>& registrations);
  template <class Stage>
  bool
  timed(const char* name, const Stage& stage);

  PreparedScan::Impl& scan_;
  const ReconstructionOptions options_;
  const ProgressCallback progress_;
  const bool is_last_;
  std::vector<cv::Mat> moving_; ///< what moves in each frame, from verify()
  ReconstructionResult result_;
};

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
  result_.findings = scan_.needCheck(result_.timing_s);
  const bool has_poses = prepare() && estimatePoses();
  if (has_poses && result_.graph)
    timed("verification", [this] {
      verify();
      return true;
    });
  const bool completed =
      has_poses && (!options_.make_mesh || result_.component_sizes.empty() || makeSurface());
  addFindings(placementFindings(result_));
  if (has_poses && !options_.poses && isTracking(options_.method))
    addFindings({trackedFinding(options_.method)});
  if (!completed)
    addFindings({stoppedFinding()});
  result_.status = !completed                        ? ReconstructionStatus::STOPPED
                   : result_.component_sizes.empty() ? ReconstructionStatus::NOTHING_REGISTERED
                   : result_.object && !result_.object->is_found ? ReconstructionStatus::NO_OBJECT
                                                                 : ReconstructionStatus::COMPLETED;
  for (FrameReport& frame : result_.frames)
    if (!completed && !frame.registered && frame.reason.empty())
      frame.reason = "the run was stopped before";
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  result_.peak_memory_bytes = std::size_t(usage.ru_maxrss) * 1024;
  return std::move(result_);
}

void
Reconstruction::addFindings(const std::vector<Finding>& findings)
{
  result_.findings.insert(result_.findings.end(), findings.begin(), findings.end());
}

/** Runs the shared stages that the method needs. */
bool
Reconstruction::prepare()
{
  const bool completed =
      options_.poses || options_.method == ReconstructionMethod::F2M_ICP ||
      (scan_.needFeatures(progress_, result_.timing_s) &&
       (isTracking(options_.method) || scan_.needGraph(progress_, result_.timing_s)));
  result_.frames = scan_.frames();
  result_.reused = scan_.reused();
  addFindings(stayingFindings(scan_.staying(), options_.moving));
  return completed;
}

bool
Reconstruction::estimatePoses()
{
  if (options_.poses)
    return usePoses();
  if (isTracking(options_.method))
    return timed("tracking", [this] { return trackFrames(); });
  return timed("registration", [this] { return mapFrames(); });
}

/** Poses as they are given; the calibration as well. */
bool
Reconstruction::usePoses()
{
  result_.model.setCalibration(options_.mapper.refinement.calibration);
  placeFrames(*options_.poses, result_);
  return true;
}

/** Tracks frame after frame in the given order. */
bool
Reconstruction::trackFrames()
{
  // Trackers take depth and camera as they come: of a calibration only the scale counts, which the
  // reader applied.
  Calibration calibration;
  calibration.depth_scale = options_.mapper.refinement.calibration.depth_scale;
  calibration.depth_scale_origin = options_.mapper.refinement.calibration.depth_scale_origin;
  result_.model.setCalibration(calibration);
  FrameToModelTracker tracker(scan_.dataset().camera(), options_.tracking);
  std::vector<std::size_t> all(result_.frames.size());
  std::iota(all.begin(), all.end(), 0);
  std::size_t tracked = 0;
  const bool completed =
      readInOrder(scan_.dataset(), all, options_.num_threads,
                  [&](std::size_t index, const RGBDFrame& rgbd, const std::string& error) {
                    std::string& reason = result_.frames[index].reason;
                    // A frame whose features failed would be tracked by depth alone.
                    if (!error.empty() || options_.method == ReconstructionMethod::F2M_ICP)
                      reason = error;
                    if (reason.empty())
                      tracked += trackFrame(tracker, index, rgbd);
                    return !progress_ || progress_({"tracking", index + 1, all.size()});
                  });
  if (tracked > 1)
    result_.component_sizes = {tracked};
  else if (completed)
    for (FrameReport& frame : result_.frames)
      if (std::exchange(frame.registered, false)) {
        frame.verdict = FrameVerdict::LEFT_OUT;
        frame.reason = "no other frame could be aligned with it";
      }
  return completed;
}

bool
Reconstruction::trackFrame(FrameToModelTracker& tracker, std::size_t index, const RGBDFrame& rgbd)
{
  FrameReport& frame = result_.frames[index];
  const bool is_visual = options_.method == ReconstructionMethod::VISUAL_ICP;
  FrameRegistration& registration = frame;
  registration = tracker.track(rgbd, is_visual ? scan_.features(index) : Features());
  if (is_visual)
    releaseMemory(scan_.features(index).descriptors);
  frame.component = frame.registered ? 0 : -1;
  frame.features = is_visual ? frame.features : 0;
  frame.by_geometry = frame.matches == 0;
  frame.world_from_depth = frame.world_from_camera;
  frame.verdict = frame.registered ? FrameVerdict::UNCHECKED : FrameVerdict::LEFT_OUT;
  return frame.registered;
}

bool
Reconstruction::mapFrames()
{
  if (is_last_)
    scan_.releaseDescriptors(true);
  result_.graph = scan_.graph();
  result_.frame_of_node = scan_.frameOfNode();
  const auto depth_of_node = [this](std::size_t node, const SparseModel& model) {
    return scan_.depthViews().get(result_.frame_of_node[node], model.calibration(),
                                  model.depthError(node));
  };
  const MapperOptions mapper_options = mapperOptions(options_, scan_.dataset().isOrdered());
  const std::unique_ptr<StoredMap> store = scan_.storedMap(mapper_options);
  IncrementalMapper mapper(*result_.graph, depth_of_node, mapper_options);
  const bool completed = mapper.run(result_.model, progress_, store.get());
  result_.reused.poses = store && store->wasKnown();
  if (is_last_) {
    scan_.releaseDescriptors();
    scan_.releaseDatabase();
  }
  result_.self_calibration = mapper.selfCalibration();
  result_.pose_prior = mapper.posePrior();
  result_.joints = mapper.joints();
  chooseWorld(result_);
  reportFrames(mapper.registrations());
  return completed;
}

void
Reconstruction::reportFrames(const std::vector<FrameRegistration>& registrations)
{
  for (std::size_t node = 0; node < registrations.size(); ++node) {
    FrameReport& frame = result_.frames[result_.frame_of_node[node]];
    static_cast<FrameRegistration&>(frame) = registrations[node];
    frame.registered = result_.model.isRegistered(node);
    if (frame.registered)
      frame.reason.clear();
    else if (frame.reason.empty())
      frame.reason = "no registered frame shares enough matches with it";
    frame.verdict = frame.registered ? FrameVerdict::UNCHECKED : FrameVerdict::LEFT_OUT;
    frame.depth_error = result_.model.depthError(node);
    reportPose(node, result_);
  }
}

/** What the other frames say of each final pose, and what follows for the scan. */
void
Reconstruction::verify()
{
  const auto view_of_node = [this](std::size_t node) {
    return scan_.depthViews().get(result_.frame_of_node[node], result_.model.calibration(),
                                  result_.model.depthError(node));
  };
  const bool has_times = scan_.dataset().isOrdered() && scan_.dataset().hasTimes();
  const Verification verification =
      verifyPoses(*result_.graph, result_.model, view_of_node, has_times, options_.num_threads);
  for (std::size_t node = 0; node < verification.frames.size(); ++node) {
    FrameReport& frame = result_.frames[result_.frame_of_node[node]];
    frame.verdict = verification.frames[node].verdict;
    frame.doubt = verification.frames[node].doubt;
    frame.depth_agreement = verification.frames[node].depth_agreement;
  }
  leaveOutRefuted(verification.frames, result_);
  const std::vector<MovingPixels> moving = findMovingPixels(
      *result_.graph, result_.model, verification.frames, view_of_node, options_.num_threads);
  moving_.resize(result_.frames.size());
  for (std::size_t node = 0; node < moving.size(); ++node) {
    moving_[result_.frame_of_node[node]] = moving[node].mask;
    result_.frames[result_.frame_of_node[node]].moving_share = moving[node].share;
  }
  addFindings(verification.findings);
  addFindings(calibrationFindings(result_.self_calibration, result_.model.calibration(),
                                  scan_.dataset().camera()));
  addFindings(timeOffsetFindings(result_, has_times));
  addFindings(stillCameraFindings(result_));
  addFindings(posePriorFindings(result_.pose_prior));
  addFindings(jointFindings(result_.joints));
  addFindings(movingFindings(result_.frames));
  addFindings(twoMotionsFindings(*result_.graph));
  addFindings(sceneFindings(result_));
}

bool
Reconstruction::makeSurface()
{
  if (is_last_) {
    scan_.releaseDescriptors(); // trackers needed them until now
    scan_.releaseDepth();
  }
  if (options_.object) {
    if (!timed("object", [this] {
          return findObject(scan_.dataset(), options_, moving_, progress_, result_);
        }))
      return false;
    if (!result_.object->is_found)
      return true;
  }
  if (!timed("surface", [this] {
        return fuseSurface(scan_.dataset(), options_, moving_, progress_, result_);
      }))
    return false;
  addFindings(unreadableFindings(result_));
  if (result_.mesh.polygons.empty())
    result_.findings.push_back(emptySurface(options_, result_));
  return !options_.next_views || timed("next views", [this] { return suggestNext(); });
}

bool
Reconstruction::suggestNext()
{
  NextViewOptions options = *options_.next_views;
  options.region = options_.volume.region;
  if (result_.object)
    options.region = result_.object->box;
  return suggestViews(scan_.dataset(), result_, moving_, options, progress_, result_.next_views);
}

Trajectory
ReconstructionResult::trajectory(int component) const
{
  Trajectory trajectory;
  for (const FrameReport& frame : frames)
    if (frame.registered && frame.component == component)
      trajectory.push_back({frame.timestamp, frame.world_from_camera});
  std::stable_sort(
      trajectory.begin(), trajectory.end(),
      [](const TimedPose& a, const TimedPose& b) { return a.timestamp < b.timestamp; });
  return trajectory;
}

ReconstructionResult
reconstruct(PreparedScan& scan, const ReconstructionOptions& options,
            const ProgressCallback& progress)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("reconstruct: " + error);
  return Reconstruction(scan, options, progress, false).run();
}

ReconstructionResult
reconstruct(const RGBDDataset& dataset, const ReconstructionOptions& options,
            const ProgressCallback& progress)
{
  PreparedScan scan(dataset, options); // checks the options
  return Reconstruction(scan, options, progress, true).run();
}

} // namespace bundle_icp
