// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "mapping/final_covariances.h"
#include "mapping/prior_motions.h"
#include "registration/frame_registrar.h"

#include <bundle_icp/mapping/incremental_mapper.h>

#include <optional>
#include <vector>

namespace bundle_icp {

/** What a ComponentAdjuster knows from the components before, and from its last adjustment. */
struct AdjusterState {
  SelfCalibrationResult self_calibration;
  int calibrated_component = -1; ///< component of the calibration
  std::size_t num_dense_neighbours = 0;
  PriorTrust prior_trust;
  int measured_component = -1;         ///< component that the prior was compared with
  std::vector<RelativePoseTerm> terms; ///< dense ones and the prior's, of the last adjustment
};

/** Adjustments of a whole component: self-calibration, global adjustment with all evidence, prior
 *  poses among it, and the motion prior. */
class ComponentAdjuster {
public:
  /** Iterations of the adjustments in between: the model will change again. */
  static constexpr int INTERMEDIATE_ITERATIONS = 3;

  ComponentAdjuster(const ImageGraph& graph, FrameRegistrar& registrar,
                    const MapperOptions& options)
  : graph_(graph), registrar_(registrar), options_(options), prior_(graph, options)
  {
    state_.num_dense_neighbours = options.refinement.num_dense_neighbours;
  }

  AdjusterState
  state() const;

  /** Goes on from the state of another adjuster of the same graph; the registrar as well. */
  void
  setState(const AdjusterState& state);

  /** Adjusts the key frames of a component that still grows. */
  void
  adjustInBetween(SparseModel& model, int component);

  /** Self-calibration, in the first component that is large enough. The registrar gets the result
   *  about depth errors. */
  void
  calibrate(SparseModel& model, int component);

  /** Adjusts the key frames with all evidence and removes outliers in between. */
  void
  adjustFinally(SparseModel& model, int component);

  /** Moves the frames of a component to their most likely poses under the motion prior.
   *  \param own covariances by frame, of poses that were found one by one, given the model; unset
   *  for poses that were adjusted together
   *  \return how well the final poses are known */
  FinalCovariances
  applyMotionPrior(SparseModel& model, int component,
                   const std::vector<std::optional<Matrix6d>>& own) const;

  /** Corrections that were tested, and those that were applied. */
  const SelfCalibrationResult&
  selfCalibration() const
  {
    return state_.self_calibration;
  }

  /** Prior poses, trusted as the component that was adjusted last shows. */
  const PriorMotions&
  prior() const
  {
    return prior_;
  }

private:
  std::vector<std::size_t>
  keyFrames(const SparseModel& model, int component) const;
  BundleAdjustmentProblem
  problem(const SparseModel& model, int component) const;
  std::vector<FinalPose>
  finalPoses(const SparseModel& model, int component,
             const std::vector<std::optional<Matrix6d>>& own) const;
  void
  tellRegistrar();
  void
  findMotions(SparseModel& model, int component) const;
  void
  adjust(SparseModel& model, int component, int max_iterations, bool dense);
  std::vector<RelativePoseTerm>
  relativePoses(const SparseModel& model, int component, const std::vector<std::size_t>& frames,
                bool dense);
  std::vector<std::size_t>
  denseNeighbours(const SparseModel& model, std::size_t frame,
                  const std::vector<std::size_t>& frames) const;
  std::vector<RelativePoseTerm>
  denseTerms(const SparseModel& model, const std::vector<std::size_t>& frames) const;

  const ImageGraph& graph_;
  FrameRegistrar& registrar_;
  const MapperOptions& options_;
  PriorMotions prior_;
  AdjusterState state_; ///< without that of prior_
};

/** Numbers the components anew, the largest first: they grow in the order of their best connected
 *  frame, which is not that of their size. */
void
numberBySize(SparseModel& model);

} // namespace bundle_icp
