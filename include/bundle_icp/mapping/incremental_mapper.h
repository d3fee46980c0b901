// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/progress.h>
#include <bundle_icp/mapping/component_joint.h>
#include <bundle_icp/mapping/pose_prior_report.h>
#include <bundle_icp/refinement/self_calibration.h>
#include <bundle_icp/registration/frame_registration.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** Steps beyond the paper: what the scan itself says of the camera and its motion. */
struct BUNDLE_ICP_EXPORT RefinementOptions {
  /** True: corrections to the camera that the scan supports are found and applied. */
  bool self_calibration = true;
  SelfCalibrationOptions calibration_test;
  /** Calibration of the camera from an earlier scan. */
  Calibration calibration;
  /** Covisible frames that get a dense term with each adjusted frame; 0 = none. */
  std::size_t num_dense_neighbours = 4;
  /** Their number where self-calibration finds that depth images have no error of their own: dense
   *  evidence is then worth more. */
  std::size_t num_exact_dense_neighbours = 20;
  /** True: the mapper ends with the most likely poses under the prior that hands move a camera
   *  smoothly. The scan shows how smoothly. Needs MappingSchedule::ordered_in_time. */
  bool motion_prior = true;
  /** True: prior poses of the graph's frames hold the model where the data are weak, and are a
   *  start where features are missing. The data show what the prior is worth: where it is less
   *  exact than its deviations say, these grow, and what contradicts the data is left out. Needs
   *  MappingSchedule::ordered_in_time. */
  bool pose_prior = true;
  /** True: parts of a scan that share too few features are joined by the shape of their surfaces,
   *  where depth holds the joint in all directions and fits no other place nearly as well. False:
   *  each stays a component of its own. Only with BUNDLE_ICP. */
  bool join_by_geometry = true;

  bool
  isValid(std::string* error = nullptr) const;
};

/** Order and frequency of the mapper's steps. */
struct BUNDLE_ICP_EXPORT MappingSchedule {
  /** Number of frames registered against the same state of the model before its update. They do not
   *  depend on each other and run in parallel. */
  std::size_t batch_size = 4;
  /** The model is adjusted each time its number of frames has grown by this factor. */
  double adjustment_growth = 1.5;
  /** False: only poses and points around each batch of frames are adjusted. */
  bool global_adjustment = true;
  /** True: time stamps show which frames are neighbours. reconstruct() sets it from the dataset. */
  bool ordered_in_time = true;

  bool
  isValid(std::string* error = nullptr) const;
};

/** How an IncrementalMapper works. */
struct BUNDLE_ICP_EXPORT MapperOptions {
  FrameRegistrationOptions registration;
  TrackOptions tracks;
  BundleAdjustmentOptions adjustment;
  RefinementOptions refinement;
  MappingSchedule schedule;
  /** Threads to use, adjustment included, 0 = all. */
  int num_threads = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** Keeps the state of a mapper while it runs, so that a later one goes on from there. */
class BUNDLE_ICP_EXPORT MapStore {
public:
  virtual ~MapStore() = default;

  /** The last state that a mapper of the same frames, matches and options has saved; unset when
   *  there is none. */
  virtual std::optional<std::string>
  load() = 0;

  virtual void
  save(const std::string& state) = 0;
};

/** The incremental sparse reconstruction of section 2.2. It starts with the pair of strongest
 *  correlation, adds the frame of highest visibility by Bundle ICP (Algorithm 1), updates points
 *  and visibility, and adjusts the model as it grows. Frames that fail are tried again later.
 *  Frames that cannot be connected become a component of their own. */
class BUNDLE_ICP_EXPORT IncrementalMapper {
public:
  using Ptr = std::shared_ptr<IncrementalMapper>;
  using ConstPtr = std::shared_ptr<const IncrementalMapper>;

  /** \throws pcl::BadArgumentException for invalid options and without a provider; run() throws it
   *  for a frame without a view. */
  IncrementalMapper(const ImageGraph& graph, DepthViewProvider depth_views,
                    const MapperOptions& options = {});
  ~IncrementalMapper();

  /** Registers all frames that it can. The largest component is number 0. A mapper runs once.
   *  \param store has the state every few seconds and at the end, and gives that of an earlier run;
   *  the result is the same as without; may be null
   *  \throws pcl::BadArgumentException when it ran before, and what `store` throws
   *  \return false when `progress` asked to stop; the model is then valid but incomplete. */
  bool
  run(SparseModel& model, const ProgressCallback& progress = {}, MapStore* store = nullptr);

  /** Outcome of each frame of the graph. Covariance and deviations are those of the final pose
   *  relative to that of the earliest frame of its component, along the axes of that frame's
   *  camera. */
  const std::vector<FrameRegistration>&
  registrations() const;

  /** Corrections that were tested, and those that were applied. */
  const SelfCalibrationResult&
  selfCalibration() const;

  /** What the prior poses were worth. */
  const PosePriorReport&
  posePrior() const;

  /** Joints of components by geometry, in their order. */
  const std::vector<ComponentJoint>&
  joints() const;

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace bundle_icp
