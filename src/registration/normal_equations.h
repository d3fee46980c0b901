// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "registration/dense_matches.h"

namespace bundle_icp {

/** Sums over matches: normal equations H delta = -g about the centre. */
struct DenseSystem {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  /** H with one normal of each product from the source. Their noise is independent, so
   * that it cancels, where in H it looks like structure that holds the pose. */
  Matrix6d structure = Matrix6d::Zero();
  double weight = 0;          ///< sum of weights / sigma^2
  double squared_error = 0;   ///< weighted sum of squared residuals [m^2]
  double weight_metric = 0;   ///< sum of the same weights
  std::size_t matched = 0;    ///< entries with a match
  std::size_t inliers = 0;    ///< of these, within three (scaled) sigma
  double squared_inliers = 0; ///< their sum of squared residuals [m^2]
};

/** Beyond so many standard deviations Tukey's biweight is 0: 95 % efficient on normal errors. */
constexpr double TUKEY_CUTOFF = 4.685;

/** Tukey's biweight of a normalised residual. */
constexpr double
robustWeight(double error)
{
  const double inside = 1 - error * error / (TUKEY_CUTOFF * TUKEY_CUTOFF);
  return inside > 0 ? inside * inside : 0;
}

/** Sums the normal equations with Tukey's biweight at `scale`. */
DenseSystem
accumulate(const Matches& matches, double scale, int num_threads);

/** Sums over visual correspondences, about a centre, and how well they agree. */
struct VisualSystem {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  double cost = 0; ///< truncated sum of squared normalised distances
  std::size_t inliers = 0;
  double squared_inliers = 0; ///< [m^2]
};

/** \param scale factor by which the true standard deviations exceed those of the
 * weights. */
VisualSystem
accumulateVisual(const VisualCorrespondences& visual, const Pose& pose,
                 const Eigen::Vector3d& center, double scale);

/** Whether the visual correspondences agree clearly less with a refined pose than with their own:
 *  more than noise and a systematic error of either sensor explain. */
bool
agreesLess(const VisualSystem& refined, const VisualSystem& own);

/** Bounds that decide whether the surfaces hold a direction. */
struct Observability {
  double length = 1; ///< that makes rotations comparable to translations [m]
  /** Share of the weight that must hold a direction: 2.5 degrees of relief, more than
   * the warp of a depth camera makes of a plane. */
  double min_share = 2e-3;
  /** True while normals are matched to those of other places: then only H itself tells what
   *  holds. */
  bool misaligned = false;
  double max_deviation =
      1e300; ///< largest standard deviation of a direction that counts as held [m]
};

/** A Gauss-Newton step about the centre, without the directions that nothing holds. */
struct Step {
  Vector6d delta = Vector6d::Zero();
  Vector6d dense_delta = Vector6d::Zero(); ///< that of dense terms alone
  Matrix6d information = Matrix6d::Zero(); ///< of dense terms where they hold
  std::vector<Vector6d> degenerate;        ///< directions that the surfaces do not hold
};

/** \param variance_factor by which dense terms overstate their information: correlation
 * and observed noise. */
Step
solve(const DenseSystem& dense, double variance_factor, const VisualSystem& visual,
      const Observability& observability);

/** The information that dense terms hold indeed: the inverse of the cluster-robust ("sandwich")
 * covariance (Liang and Zeger 1986), H^-1 M H^-1, where M is the scatter of gradients that are
 * independent of each other. Unlike H it knows of errors that pixels share, and of structures that
 * are known worse than the rest.
 *  \param information of the step that is left, that is H / variance_factor, where the pose is held
 *  \param gradients of H's terms by tile; with less than a dozen `information` itself is returned
 *  \param model_share AlignmentProblem::model_share */
Matrix6d
robustInformation(const Matrix6d& information, double variance_factor,
                  const std::vector<Vector6d>& gradients, double model_share);

} // namespace bundle_icp
