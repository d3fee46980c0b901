// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/progress.h>
#include <bundle_icp/registration/virtual_depth.h>
#include <bundle_icp/sparse/self_calibration.h>
#include <bundle_icp/sparse/sparse_model.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace bundle_icp {

/** What finds the pose of a new image. */
enum class ImageRegistrationMethod {
  BUNDLE_ICP, ///< Algorithm 1 of the paper: visual pose, then ICP against the virtual depth
  VISUAL,     ///< lines 1 and 2 alone: 3D-3D distances of matched features
  PNP         ///< 2D-3D, as in structure from motion from colour alone
};

/** How an IncrementalMapper works. */
struct BUNDLE_ICP_EXPORT MapperOptions {
  ImageRegistrationMethod method = ImageRegistrationMethod::BUNDLE_ICP;
  /** False: ICP starts from the pose of the neighbour that shares most matches (only with
   *  BUNDLE_ICP). Shows what the visual pose is worth. */
  bool visual_start = true;
  /** False: poses and points are adjusted around each batch of images only. */
  bool global_adjustment = true;
  TrackOptions tracks;
  BundleAdjustmentOptions adjustment;
  VirtualDepthOptions virtual_depth;
  /** Visual correspondences that must support the pose of a new image. */
  std::size_t min_visual_inliers = 12;
  /** An image whose position is known no better than this in some direction is not registered,
   *  standard deviation [m]. */
  double max_position_deviation = 0.03;
  /** Nor one whose rotation is not, about some axis [rad]. */
  double max_rotation_deviation = 0.03;
  /** Registered neighbours that take part in a virtual depth map: the best covisible ones, so
   *  that the cost per image does not grow with the model. */
  std::size_t max_views = 6;
  /** Images registered against the same state of the model before it is updated: they are
   *  independent of each other and run in parallel. */
  std::size_t batch_size = 4;
  /** The model is adjusted each time it has grown by this factor. */
  double adjustment_growth = 1.5;
  /** Share of an image's depth that must lie on the virtual depth when geometry alone
   *  registers it. */
  double min_overlap = 0.5;
  /** Covisible images with which each adjusted image gets a dense term; 0 = none. */
  std::size_t num_dense_neighbours = 4;
  /** The same where self-calibration finds that images have no depth error of their own: dense
   *  evidence is worth more then. */
  std::size_t num_exact_dense_neighbours = 20;
  /** Depth errors that all pixels of an image share do not average out over the image: each image's
   *  depth is known as a whole to so many sigma of DepthNoise, as a shift and as a tilt per unit of
   *  x / z. Limits the weight of dense terms, unless self-calibration finds that the scan does not
   *  support such errors. */
  double shared_depth_sigmas = 2;
  /** Corrections to the camera that the scan supports are found and applied. */
  bool self_calibration = true;
  SelfCalibrationOptions calibration_test;
  /** What is known of the camera beforehand, from an earlier scan. */
  Calibration calibration;
  /** Ends with the most likely poses, given that hands move a camera smoothly: how smoothly follows
   *  from the scan itself. Only where ordered_in_time. */
  bool motion_prior = true;
  /** Whether time stamps tell which images are neighbours. reconstruct() asks the dataset. */
  bool ordered_in_time = true;
  /** Threads to use, 0 = all; for the adjustment, too. */
  int num_threads = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** What became of an image. */
struct ImageRegistration {
  bool registered = false;
  std::string reason;      ///< why it is not registered
  std::size_t matches = 0; ///< visual correspondences to registered images
  std::size_t inliers = 0; ///< those that agree with the pose
  /** Distance to the virtual depth [m]; 0 where it was not aligned, since it could not have
   *  improved the pose of an image that is not a key image. */
  double icp_rmse = 0;
  bool by_geometry = false; ///< without visual evidence
  /** Largest standard deviation in any direction when it was registered, given the model: of the
   *  camera's position [m], and of its rotation [rad]. */
  double position_deviation = 0;
  double rotation_deviation = 0;
};

/** Gives the prepared depth of an image, corrected by the model's calibration and the image's
 *  DepthError; called by several threads. */
using DepthViewProvider =
    std::function<std::shared_ptr<const DepthView>(std::size_t image, const SparseModel& model)>;

/** The incremental sparse reconstruction of section 2.2: starts with the pair of strongest
 *  correlation, adds the image of highest visibility by Bundle ICP (Algorithm 1), updates
 *  points and visibility, and adjusts the model as it grows. Images that fail are put back
 *  and tried again; what cannot be connected becomes a component of its own. */
class BUNDLE_ICP_EXPORT IncrementalMapper {
public:
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
