// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/model/sparse_model.h>

#include <string>
#include <vector>

namespace bundle_icp {

/** What is known of the motion between two frames. Of dense registration: all point-to-plane terms
 *  between them, reduced to a mean motion and a 6x6 information matrix. */
struct RelativePoseTerm {
  std::size_t first = 0;
  std::size_t second = 0;
  Pose first_from_second = Pose::Identity();
  /** Of increment(delta) * first_from_second; zero along directions that geometry does not
   *  constrain. */
  Matrix6d information = Matrix6d::Zero();
  /** True: it comes from the two depth images, whose noise other terms of the frames share. */
  bool is_dense = true;
};

/** Frames that an adjustment moves, and evidence besides the tracks. */
struct BundleAdjustmentProblem {
  /** Frames whose pose is adjusted. Their tracks and points take part. */
  std::vector<std::size_t> variable;
  /** Frames that take part but keep their pose. When the list is empty, the first variable frame
   *  keeps its pose, which fixes the gauge. */
  std::vector<std::size_t> constant;
  /** Dense evidence, motions of prior poses. Terms with a frame outside both lists are ignored. */
  std::vector<RelativePoseTerm> relative_poses;
  /** Parameters of SparseModel::calibration() to adjust. */
  std::vector<CalibrationParameter> calibrated;
  /** True: the DepthError of each variable frame is adjusted. */
  bool depth_errors = false;
  /** Tracks with fewer observations by frames that take part are ignored. */
  std::size_t min_track_length = 2;
  /** True: a fifth of the observations in tracks of four or more is left out, which
   *  self-calibration uses to test what was found without them. */
  bool hold_back = false;
};

/** Solver of an adjustment. Both solvers minimise the same cost. */
enum class AdjustmentSolver {
  /** The faster solver. That is SCHUR: on no adjustment of any recording did Ceres come within 1.2
   *  times the time of SCHUR (docs/benchmarks.md), so no rule needs to choose. */
  AUTO,
  CERES, ///< Ceres Solver, in one thread
  SCHUR, ///< the library's own solver, which eliminates points in parallel
};

/** How an adjustment is solved. */
struct BUNDLE_ICP_EXPORT BundleAdjustmentOptions {
  AdjustmentSolver solver = AdjustmentSolver::AUTO;
  int max_iterations = 30;
  /** Scale of the Cauchy loss on residuals, which are divided by their own sigma. */
  double loss_scale = 2;
  /** The solver stops when an iteration lowers the cost by less than this share. */
  double function_tolerance = 1e-4;
  /** True: residuals of measured depth take part. */
  bool use_depth = true;
  /** Prior standard deviation of each number of a DepthError [sigma of DepthNoise]. */
  double depth_error_deviation = 2;
  /** Threads to use, 0 = all. The result does not depend on the number. Ceres always uses one
   *  thread: more threads would add up in the order in which they finish. */
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

/** Prior standard deviations of the calibration: how far cameras as sold differ from their nominal
 *  values. Values near 0 are likely. A value that the scan does not determine stays near 0. */
BUNDLE_ICP_EXPORT const CalibrationVector&
calibrationPrior();

/** Global (or local) bundle adjustment: moves poses and points to the minimum of the robust sum of
 *  squared pixel residuals, measured-depth residuals and dense relative poses. Calibration and
 *  depth errors move if `problem` says so; priors hold them. The method is Levenberg-Marquardt, by
 *  Ceres or with the points eliminated from the normal equations (Triggs et al., "Bundle adjustment
 *  - a modern synthesis", 6.1).
 *  \throws pcl::BadArgumentException for invalid options or unregistered frames. */
BUNDLE_ICP_EXPORT BundleAdjustmentResult
adjustBundle(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
             const BundleAdjustmentOptions& options, SparseModel& model);

/** Local bundle adjustment: the poses of `frames` and the points that these frames see move. The
 *  `num_held` frames that share most points with them take part, but keep their poses. The time
 *  does not grow with the model. Without a frame that shares a point nothing happens.
 *  \throws as adjustBundle() */
BUNDLE_ICP_EXPORT BundleAdjustmentResult
adjustLocally(const ImageGraph& graph, const std::vector<std::size_t>& frames, std::size_t num_held,
              const BundleAdjustmentOptions& options, SparseModel& model);

} // namespace bundle_icp
