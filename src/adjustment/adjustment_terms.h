// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/adjustment/bundle_adjustment.h>

#include "adjustment/residuals.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

namespace bundle_icp {

/** The unknowns of an adjustment; poses and depth errors by AdjustmentTerms::frames, points by its
 *  points. */
struct AdjustmentState {
  std::vector<PoseBlock> poses;
  std::vector<DepthError> depth_errors;
  std::vector<Eigen::Vector3d> points;
  CalibrationVector calibration;
};

/** A frame that takes part. */
struct AdjustedFrame {
  std::size_t frame;
  bool pose_moves;
  bool depth_error_moves;
  FrameMeasurement measurement;
};

/** An observation that takes part. */
struct AdjustedObservation {
  int frame; ///< index into AdjustmentTerms::frames
  int point; ///< index into AdjustmentTerms::points
  ObservationResiduals residuals;
};

/** A dense term between frames that take part. */
struct AdjustedPair {
  int first, second; ///< indices into AdjustmentTerms::frames
  std::unique_ptr<RelativePoseResidual> residual;
};

/** All terms of one adjustment: what is observed, and by which frames. */
class AdjustmentTerms {
public:
  /** \throws pcl::BadArgumentException for frames that are not registered. */
  AdjustmentTerms(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
                  const BundleAdjustmentOptions& options, const SparseModel& model);

  AdjustmentState
  initialState(const SparseModel& model) const;

  void
  writeBack(const AdjustmentState& state, SparseModel& model) const;

  /** Half the sum of the squared residuals, those of observations under the robust loss. */
  double
  cost(const AdjustmentState& state, int num_threads) const;

  /** Residuals and derivatives of an observation; 0 for derivatives by what does not move. */
  ObservationRows
  linearise(const AdjustedObservation& observation, const AdjustmentState& state) const;

  std::size_t
  numResiduals() const;

  /** Number of chunks of points. Chunks do not depend on the number of threads. */
  std::size_t
  numChunks() const
  {
    return (points.size() + CHUNK - 1) / CHUNK;
  }

  /** First point of a chunk, and one past the last. */
  std::pair<std::size_t, std::size_t>
  pointsOf(std::size_t chunk) const
  {
    return {chunk * CHUNK, std::min(points.size(), (chunk + 1) * CHUNK)};
  }

  /** Prior standard deviation of each number of a DepthError. */
  double
  depthErrorDeviation() const
  {
    return options_.depth_error_deviation;
  }

  std::vector<AdjustedFrame> frames;             ///< those that move first
  std::size_t num_moving = 0;                    ///< frames with any unknown
  std::vector<std::size_t> points;               ///< of the model
  std::vector<AdjustedObservation> observations; ///< by point
  std::vector<std::size_t> first_observation;    ///< of each point, and one past the last
  std::vector<AdjustedPair> pairs;
  std::vector<int> calibrated; ///< parameters that move, ascending

private:
  static constexpr std::size_t CHUNK = 128;

  void
  addFrames(const BundleAdjustmentProblem& problem, const SparseModel& model);

  void
  addObservations(const BundleAdjustmentProblem& problem, const SparseModel& model);

  const ImageGraph& graph_;
  const BundleAdjustmentOptions& options_;
};

} // namespace bundle_icp
