// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/rigid_alignment.h>

#include <Eigen/Dense>
#include <pcl/exceptions.h>

#include <array>
#include <cmath>
#include <random>

namespace bundle_icp {
namespace {

double
squaredSigmas(const Pose& target_from_source, const PointPair& pair)
{
  return (target_from_source * pair.source - pair.target).squaredNorm() / pair.variance;
}

/** Sum of squared distances in sigmas, truncated at the inlier bound: MSAC's score. */
double
truncatedCost(const Pose& pose, const std::vector<PointPair>& pairs, double bound, double best)
{
  double cost = 0;
  for (const PointPair& pair : pairs) {
    cost += std::min(bound, squaredSigmas(pose, pair));
    if (cost > best)
      break;
  }
  return cost;
}

/** Three pairs fix a motion only when they are distinct, not on a line, and span triangles
 *  of the same shape: the last rejects most bad samples before they are solved. */
bool
isUsableSample(const std::array<const PointPair*, 3>& sample, double inlier_sigmas)
{
  for (int k = 0; k < 3; ++k) {
    const PointPair &a = *sample[k], &b = *sample[(k + 1) % 3];
    const double source = (a.source - b.source).norm();
    const double target = (a.target - b.target).norm();
    const double sigma = std::sqrt(a.variance + b.variance);
    if (source < 2 * sigma || std::abs(source - target) > inlier_sigmas * sigma)
      return false;
  }
  const Eigen::Vector3d u = sample[1]->source - sample[0]->source;
  const Eigen::Vector3d v = sample[2]->source - sample[0]->source;
  return u.cross(v).norm() > 0.05 * u.norm() * v.norm();
}

std::vector<std::size_t>
findInliers(const Pose& pose, const std::vector<PointPair>& pairs, double bound)
{
  std::vector<std::size_t> inliers;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (squaredSigmas(pose, pairs[i]) < bound)
      inliers.push_back(i);
  return inliers;
}

/** Reweighted least squares with Cauchy weights inside the inlier bound. */
Pose
refine(Pose pose, const std::vector<PointPair>& pairs, const RigidAlignmentOptions& options)
{
  const double bound = options.inlier_sigmas * options.inlier_sigmas;
  std::vector<double> factors(pairs.size());
  for (int iteration = 0; iteration < options.refinements; ++iteration) {
    int used = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double squared = squaredSigmas(pose, pairs[i]);
      factors[i] = squared < bound ? 1 / (1 + squared / 3) : 0;
      used += factors[i] > 0;
    }
    if (used < 3)
      break;
    pose = rigidAlignment(pairs, factors);
  }
  return pose;
}

/** The inliers must not lie on a line, or the rotation about it is free. */
bool
spansAPlane(const std::vector<PointPair>& pairs, const std::vector<std::size_t>& inliers)
{
  if (inliers.size() < 3)
    return false;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double variance = 0;
  for (const std::size_t i : inliers) {
    mean += pairs[i].source / inliers.size();
    variance += pairs[i].variance / inliers.size();
  }
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::size_t i : inliers) {
    const Eigen::Vector3d d = pairs[i].source - mean;
    scatter += d * d.transpose() / inliers.size();
  }
  const Eigen::Vector3d values =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues();
  return values[1] > 4 * variance;
}

} // namespace

bool
RigidAlignmentOptions::isValid(std::string* error) const
{
  const char* reason = !(inlier_sigmas > 0)                 ? "inlier_sigmas must be > 0"
                       : max_iterations < 1                 ? "max_iterations must be >= 1"
                       : !(confidence > 0 && confidence < 1) ? "confidence must lie in (0, 1)"
                       : refinements < 0                    ? "refinements must be >= 0"
                                                            : nullptr;
  if (reason && error)
    *error = reason;
  return !reason;
}

Pose
rigidAlignment(const std::vector<PointPair>& pairs, const std::vector<double>& factors)
{
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero(), target_mean = source_mean;
  double sum = 0;
  const auto weight = [&](std::size_t i) {
    return (factors.empty() ? 1.0 : factors[i]) / pairs[i].variance;
  };
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    sum += weight(i);
    source_mean += weight(i) * pairs[i].source;
    target_mean += weight(i) * pairs[i].target;
  }
  Pose pose = Pose::Identity();
  if (!(sum > 0))
    return pose;
  source_mean /= sum;
  target_mean /= sum;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i)
    covariance += weight(i) / sum * (pairs[i].target - target_mean) *
                  (pairs[i].source - source_mean).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0)
    sign[2] = -1;
  pose.linear() = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  pose.translation() = target_mean - pose.linear() * source_mean;
  return pose;
}

RigidAlignment
robustRigidAlignment(const std::vector<PointPair>& pairs, const RigidAlignmentOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw pcl::BadArgumentException("robustRigidAlignment: " + error);
  RigidAlignment result;
  if (pairs.size() < 3)
    return result;
  const double bound = options.inlier_sigmas * options.inlier_sigmas;
  double best = bound * pairs.size();
  std::mt19937_64 random(options.seed);
  // Fixed-point scaling instead of std::uniform_int_distribution, whose results differ
  // between standard libraries.
  const auto draw = [&] { return (random() >> 32) * pairs.size() >> 32; };
  double needed = options.max_iterations;
  for (int iteration = 0; iteration < needed; ++iteration) {
    const std::array<const PointPair*, 3> sample{
        &pairs[draw()], &pairs[draw()], &pairs[draw()]};
    if (!isUsableSample(sample, options.inlier_sigmas))
      continue;
    const Pose pose = rigidAlignment({*sample[0], *sample[1], *sample[2]});
    const double cost = truncatedCost(pose, pairs, bound, best);
    if (cost >= best)
      continue;
    best = cost;
    result.target_from_source = pose;
    const double share = findInliers(pose, pairs, bound).size() / double(pairs.size());
    const double miss = std::log(1 - std::min(0.9999, share * share * share));
    needed = std::min<double>(options.max_iterations, std::log(1 - options.confidence) / miss);
  }
  if (best >= bound * pairs.size())
    return result;
  result.target_from_source = refine(result.target_from_source, pairs, options);
  result.inliers = findInliers(result.target_from_source, pairs, bound);
  result.success = spansAPlane(pairs, result.inliers);
  double sum = 0;
  for (const std::size_t i : result.inliers)
    sum += squaredSigmas(result.target_from_source, pairs[i]);
  if (!result.inliers.empty())
    result.rmse = std::sqrt(sum / (3 * result.inliers.size()));
  return result;
}

} // namespace bundle_icp
