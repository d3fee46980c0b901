// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/model/sparse_model.h>

#include <string>
#include <vector>

namespace bundle_icp {

/** What dense registration knows of the motion between two images: the reduction of all
 *  point-to-plane terms between them to a mean and a 6x6 information matrix. */
struct RelativePoseTerm {
  std::size_t first = 0;
  std::size_t second = 0;
  Pose first_from_second = Pose::Identity();
  /** Of increment(delta) * first_from_second; zero along directions that geometry leaves free. */
  Matrix6d information = Matrix6d::Zero();
};

/** Which images an adjustment moves, and what it knows besides the tracks. */
struct BundleAdjustmentProblem {
  /** Images whose pose is adjusted; their tracks and points take part. */
  std::vector<std::size_t> variable;
  /** Images that take part but stay where they are. When this is empty the first variable image
   *  is held, which fixes the gauge. */
  std::vector<std::size_t> constant;
  /** Dense evidence; terms with images outside both lists are ignored. */
  std::vector<RelativePoseTerm> relative_poses;
  /** Parameters of SparseModel::calibration() that are adjusted. */
  std::vector<CalibrationParameter> calibrated;
  /** Whether the DepthError of the variable images is adjusted. */
  bool depth_errors = false;
  /** Tracks with fewer observations by images that take part are left out. */
  std::size_t min_track_length = 2;
  /** Leaves out the observations that isHeldBack(). */
  bool hold_back = false;
};

/** What solves an adjustment: both go down to the same cost. */
enum class AdjustmentSolver {
  /** The faster one. That is SCHUR: on no adjustment of any recording did Ceres come within 1.2
   *  times its time (docs/benchmarks.md), so that there is no rule to choose by. */
  AUTO,
  CERES, ///< Ceres Solver, in one thread
  SCHUR, ///< the library's own, which eliminates points in parallel
};

/** How an adjustment is solved. */
struct BUNDLE_ICP_EXPORT BundleAdjustmentOptions {
  AdjustmentSolver solver = AdjustmentSolver::AUTO;
  int max_iterations = 30;
  /** Scale of the Cauchy loss on residuals, each over its own sigma. */
  double loss_scale = 2;
  /** Stops when an iteration lowers the cost by less than this share. */
  double function_tolerance = 1e-4;
  /** Residuals of measured depth take part. */
  bool use_depth = true;
  /** Prior standard deviation of each number of a DepthError [sigma of DepthNoise]. */
  double depth_error_deviation = 2;
  /** Threads to use, 0 = all; the result does not depend on it. Ceres works in one whatever is said
   *  here: with more it adds up in the order in which they finish. */
  int num_threads = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** Outcome of an adjustment. */
struct BundleAdjustmentResult {
  bool success = false;
  int iterations = 0;
  std::size_t num_residuals = 0;
  double initial_cost = 0;
  double final_cost = 0;
};

/** Prior standard deviations of the calibration: how far cameras as they are sold differ from their
 *  nominal values. Values near 0 are likely, and what the scan does not show stays there. */
BUNDLE_ICP_EXPORT const CalibrationVector&
calibrationPrior();

/** Whether an observation is kept back to test a calibration: a fifth of those in tracks of
 *  four or more, chosen by number. */
BUNDLE_ICP_EXPORT bool
isHeldBack(const ScenePoint& point, std::size_t index_in_track);

/** Robust cost of the observations that isHeldBack(), of points that took part in the adjustment of
 *  `problem`: for each variable image, in their order. */
BUNDLE_ICP_EXPORT std::vector<double>
heldBackCost(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
             const BundleAdjustmentOptions& options, const SparseModel& model);

/** Standard deviations of calibration parameters, given all that `problem` knows: from the inverse
 *  of the normal equations at the present state; 0 for those that are not adjusted. */
BUNDLE_ICP_EXPORT CalibrationVector
calibrationDeviations(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
                      const BundleAdjustmentOptions& options, const SparseModel& model);

/** Global (or local) bundle adjustment: moves poses and points to the minimum of the robust sum of
 *  squared pixel residuals, measured-depth residuals and dense relative poses; calibration and
 *  depth errors move where the problem says so, held near their priors. Levenberg-Marquardt, by
 *  Ceres or with the points eliminated from the normal equations (Triggs et al., "Bundle adjustment
 *  - a modern synthesis", 6.1).
 *  \throws pcl::BadArgumentException for invalid options or unregistered images. */
BUNDLE_ICP_EXPORT BundleAdjustmentResult
adjustBundle(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
             const BundleAdjustmentOptions& options, SparseModel& model);

/** Local bundle adjustment: the poses of `images` and the points that they see move; the
 *  `num_held` images that share most points with them take part, but are held. Its cost does not
 *  grow with the model. Does nothing when no other image shares a point with them.
 *  \throws as adjustBundle() */
BUNDLE_ICP_EXPORT BundleAdjustmentResult
adjustLocally(const ImageGraph& graph, const std::vector<std::size_t>& images, std::size_t num_held,
              const BundleAdjustmentOptions& options, SparseModel& model);

} // namespace bundle_icp
