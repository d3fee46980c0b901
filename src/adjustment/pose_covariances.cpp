// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/pose_covariances.h"

#include "adjustment/pose_adjustment.h"
#include "adjustment/reduced_system.h"

#include <map>

namespace bundle_icp {
namespace {

/** Keeps the normal equations regular where a frame has lost all of its observations. */
constexpr double DAMPING = 1e-9;

/** Divides the information of dense terms by what they share; others share nothing. Among n frames
 *  each compared with all others, n (n - 1) / 2 terms with the noise of n depth images say n / 2
 *  times too much; of a chain of frames each term stands for itself. */
void
divideByShared(std::vector<RelativePoseTerm>& terms)
{
  std::map<std::size_t, double> count;
  for (const RelativePoseTerm& term : terms)
    if (term.is_dense) {
      ++count[term.first];
      ++count[term.second];
    }
  for (RelativePoseTerm& term : terms) {
    if (!term.is_dense)
      continue;
    const double mean = (count[term.first] + count[term.second]) / 2;
    term.information *= 2 / (mean + 1);
  }
}

template <int SIZE>
std::vector<Matrix6d>
motionCovariances(const AdjustmentTerms& terms, const AdjustmentState& state, int num_threads)
{
  ReducedSystem<SIZE> system(terms, num_threads);
  system.build(state, DAMPING);
  return system.poseCovariances();
}

} // namespace

std::vector<Matrix6d>
poseCovariances(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
                const BundleAdjustmentOptions& options, const SparseModel& model)
{
  BundleAdjustmentProblem evidence = problem;
  divideByShared(evidence.relative_poses);
  const AdjustmentTerms terms(graph, evidence, options, model);
  const AdjustmentState state = terms.initialState(model);
  const std::vector<Matrix6d> of_motion =
      (problem.depth_errors ? motionCovariances<9> : motionCovariances<6>)(terms, state,
                                                                           options.num_threads);
  std::map<std::size_t, Matrix6d> by_frame;
  for (std::size_t i = 0; i < terms.num_moving; ++i) {
    const std::size_t frame = terms.frames[i].frame;
    const Matrix6d world_by_motion = worldByMotion(model.worldFromCamera(frame));
    by_frame[frame] = world_by_motion * of_motion[i] * world_by_motion.transpose();
  }
  std::vector<Matrix6d> result;
  for (const std::size_t frame : problem.variable)
    result.push_back(by_frame.count(frame) ? by_frame[frame] : Matrix6d::Zero());
  return result;
}

} // namespace bundle_icp
