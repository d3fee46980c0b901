// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "registration/nearest_matches.h"
#include "registration/normal_equations.h"

namespace bundle_icp {

/** A small motion about a centre instead of the origin. */
Pose
motionAbout(const Eigen::Vector3d& center, const Vector6d& delta);

/** The terms of an alignment at a pose: dense ones, the distances between closest points on one
 *  level of detail, and visual ones. Algorithm 1 of the paper, lines 5 and 6. */
class AlignmentTerms {
public:
  /** What the terms say at a pose. */
  struct Evaluation {
    DenseSystem dense;
    VisualSystem visual;
    double scale = 1;    ///< observed over expected noise
    double variance = 1; ///< by which dense terms overstate their information
    Step step;
  };

  explicit AlignmentTerms(const AlignmentProblem& problem);

  /** Prepares target and levels; from then on motions are about the middle of the source at a pose.
   *  \return false when the source has no finite point */
  bool
  prepare(const Pose& pose);

  /** Renders the target anew when the pose has moved far from where it was rendered.
   *  \return true when it was */
  bool
  renderAgain(const Pose& pose);

  /** Sets the level and how far it expects the surfaces to lie apart [m]. */
  void
  useLevel(std::size_t level, float misalignment);

  /** Finds the matches, which stay until the next call, and the step that the terms ask for. */
  Evaluation
  evaluate(const Pose& pose);

  VisualSystem
  visualTerms(const Pose& pose) const
  {
    return accumulateVisual(problem_.visual, pose, center_, problem_.visual_scale);
  }

  /** Of the last evaluation, which was at this pose; `scale` as in meetingByProjection(). */
  Meeting
  meeting(const Pose& pose, double scale) const;

  /** What the dense terms of the last evaluation tell of the pose, as motions about center(). */
  Matrix6d
  information(const Evaluation& last) const;

  /** Whether matches are found by projection. */
  bool
  projective() const
  {
    return grid_.has_value();
  }

  /** How often the target was rendered anew. */
  int
  renderings() const
  {
    return renderings_;
  }

  std::size_t
  numLevels() const
  {
    return levels_.size();
  }

  /** Points of the level. */
  const SourcePoints&
  source() const
  {
    return levels_[level_];
  }

  const Matches&
  matches() const
  {
    return matches_;
  }

  const Eigen::Vector3d&
  center() const
  {
    return center_;
  }

private:
  double
  smallestScale() const;

  AlignmentProblem problem_;
  std::vector<int> all_indices_; ///< when the problem names none
  NearestMatcher nearest_;
  std::optional<TargetGrid> grid_;
  int renderings_ = 0;
  std::vector<SourcePoints> levels_;
  std::size_t level_ = 0;
  MatchTolerance tolerance_;
  Matches matches_;
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();
  double length_ = 1; ///< of the source, that makes rotations comparable to translations
};

} // namespace bundle_icp
