// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/progress.h>
#include <bundle_icp/refinement/self_calibration.h>
#include <bundle_icp/registration/frame_registration.h>

#include <memory>
#include <string>
#include <vector>

namespace bundle_icp {

/** What goes beyond the paper: what the scan itself says of the camera and its motion. */
struct BUNDLE_ICP_EXPORT RefinementOptions {
  /** Corrections to the camera that the scan supports are found and applied. */
  bool self_calibration = true;
  SelfCalibrationOptions calibration_test;
  /** What is known of the camera beforehand, from an earlier scan. */
  Calibration calibration;
  /** Covisible frames with which each adjusted frame gets a dense term; 0 = none. */
  std::size_t num_dense_neighbours = 4;
  /** The same where self-calibration finds that depth images have no error of their own: dense
   *  evidence is worth more then. */
  std::size_t num_exact_dense_neighbours = 20;
  /** Ends with the most likely poses, given that hands move a camera smoothly. The scan itself
   *  tells how smoothly. Only where MappingSchedule::ordered_in_time. */
  bool motion_prior = true;

  bool
  isValid(std::string* error = nullptr) const;
};

/** In which order things happen. */
struct BUNDLE_ICP_EXPORT MappingSchedule {
  /** Frames registered against the same state of the model before it is updated: they are
   *  independent of each other and run in parallel. */
  std::size_t batch_size = 4;
  /** The model is adjusted each time it has grown by this factor. */
  double adjustment_growth = 1.5;
  /** False: poses and points are adjusted around each batch of frames only. */
  bool global_adjustment = true;
  /** Whether time stamps tell which frames are neighbours. reconstruct() asks the dataset. */
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
  /** Threads to use, 0 = all; for the adjustment, too. */
  int num_threads = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** The incremental sparse reconstruction of section 2.2: starts with the pair of strongest
 *  correlation, adds the image of highest visibility by Bundle ICP (Algorithm 1), updates
 *  points and visibility, and adjusts the model as it grows. Images that fail are put back
 *  and tried again; what cannot be connected becomes a component of its own. */
class BUNDLE_ICP_EXPORT IncrementalMapper {
public:
  using Ptr = std::shared_ptr<IncrementalMapper>;
  using ConstPtr = std::shared_ptr<const IncrementalMapper>;

  /** \throws pcl::BadArgumentException for invalid options. */
  IncrementalMapper(const ImageGraph& graph, DepthViewProvider depth_views,
                    const MapperOptions& options = {});
  ~IncrementalMapper();

  /** Registers all images that can be. The largest component is number 0.
   *  \return false when `progress` asked to stop; the model is then valid but incomplete. */
  bool
  run(SparseModel& model, const ProgressCallback& progress = {});

  /** What became of each image of the graph. */
  const std::vector<ImageRegistration>&
  registrations() const;

  /** Which corrections were tested, and which applied. */
  const SelfCalibrationResult&
  selfCalibration() const;

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace bundle_icp
