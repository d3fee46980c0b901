// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "refinement/pose_evidence.h"
#include "registration/frame_registrar.h"

#include <vector>

namespace bundle_icp {

/** Frames of a part of a scan, whose poses are in one world. */
using Part = std::vector<std::size_t>;

/** A motion between the worlds of two parts, and what the depth of both says of it. */
struct JointEvidence {
  Pose first_from_second = Pose::Identity();
  /** Share of a frame's depth that agrees with one frame of the other part: the sum over the frames
   *  of the second part, and the largest of both parts. */
  double shared = 0, overlap = 0;
  DepthAgreement depth;    ///< over all pairs of frames, in both directions
  std::size_t held = 0;    ///< frames that depth alone places so, without a direction left open
  std::size_t matches = 0; ///< matches of one pair of frames that agree with the motion

  double
  agreement() const
  {
    return depth.compared() > 0 ? depth.agree / depth.compared() : 0;
  }

  /** Shared depth, less where some contradicts. */
  double
  support() const
  {
    return shared * agreement() * agreement();
  }
};

/** The frames that share depth with a frame, most first; `matches` counts pixels of its grid.
 *  \param world_from_depth the frame's pose in their world, right within some centimetres
 *  \param min_share of the frame's depth, 0 to 1 */
std::vector<Neighbour>
framesSharingDepth(const SparseModel& model, const DepthViewProvider& depth_views,
                   std::size_t frame, const Pose& world_from_depth, const Part& frames,
                   double min_share);

/** Measures what depth says of motions between two parts of a model. Refers to its arguments.
 *  Several threads may call all methods. */
class JointJudge {
public:
  JointJudge(const SparseModel& model, const DepthViewProvider& depth_views,
             const FrameRegistrar& registrar, std::size_t max_views)
  : model_(model), depth_views_(depth_views), registrar_(registrar), max_views_(max_views)
  {
  }

  /** What depth says of a motion that is right within some centimetres. */
  JointEvidence
  measureRoughly(const Part& first, const Part& second, const Pose& first_from_second) const;

  /** The frames of either part that share most are aligned with the virtual depth of the other: the
   *  best of the motions that they give. No shared depth when none converges. */
  JointEvidence
  refine(const Part& first, const Part& second, const Pose& first_from_second) const;

private:
  /** A frame of one part, and the frames of the other that share most depth with it. */
  struct Candidate {
    NewFrame frame;
    bool is_of_first;
  };

  JointEvidence
  measure(const Part& first, const Part& second, const Pose& first_from_second,
          const DepthComparisonOptions& options) const;
  void
  addCandidates(const Part& from, const Part& to, const Pose& to_from_from, bool is_of_first,
                std::vector<Candidate>& candidates) const;

  const SparseModel& model_;
  const DepthViewProvider& depth_views_;
  const FrameRegistrar& registrar_;
  const std::size_t max_views_;
};

/** Whether two motions bring a part to one place, within the error that its poses may have. */
bool
areSamePlace(const SparseModel& model, const Part& second, const Pose& a, const Pose& b);

} // namespace bundle_icp
