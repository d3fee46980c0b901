// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/rigid_alignment.h>

#include <bundle_icp/common/exceptions.h>

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace bundle_icp {
namespace {

constexpr int REWEIGHTINGS = 10;
/** Minimum number of samples: samples that hit the consensus still differ in accuracy. */
constexpr double MIN_SAMPLES = 50;

using Sample = std::array<std::size_t, 3>;

double
squaredSigmas(const Pose& target_from_source, const PointPair& pair)
{
  return pair.weight * (target_from_source * pair.source - pair.target).squaredNorm();
}

/** Cost of a sample's pose: squared errors, those of outliers cut off (MSAC). */
double
truncatedCost(const std::vector<PointPair>& pairs, const Pose& pose, double limit, double best)
{
  double cost = 0;
  for (std::size_t i = 0; i < pairs.size() && cost < best; ++i)
    cost += std::min(limit, squaredSigmas(pose, pairs[i]));
  return cost;
}

Sample
drawSample(std::mt19937_64& random, std::size_t size)
{
  Sample sample;
  do
    for (std::size_t& index : sample)
      index = random() % size;
  while (sample[0] == sample[1] || sample[0] == sample[2] || sample[1] == sample[2]);
  return sample;
}

/** True when the three sides agree within noise: a rigid motion keeps distances. */
bool
keepsDistances(const std::vector<PointPair>& pairs, const Sample& sample, double sigmas)
{
  for (std::size_t k = 0; k < 3; ++k) {
    const PointPair &a = pairs[sample[k]], &b = pairs[sample[(k + 1) % 3]];
    const double before = (a.source - b.source).norm();
    const double after = (a.target - b.target).norm();
    const double sigma = std::sqrt(1 / a.weight + 1 / b.weight);
    if (std::abs(before - after) > sigmas * sigma || before < 2 * sigma)
      return false;
  }
  return true;
}

std::optional<Pose>
sampleConsensus(const std::vector<PointPair>& pairs, const RigidAlignmentOptions& options)
{
  const double limit = options.inlier_sigmas * options.inlier_sigmas;
  const double worst_cost = double(pairs.size()) * limit;
  std::mt19937_64 random(options.seed);
  std::optional<Pose> best;
  double best_cost = worst_cost, needed = options.max_samples;
  for (int k = 0; k < options.max_samples && k < needed; ++k) {
    const Sample sample = drawSample(random, pairs.size());
    if (!keepsDistances(pairs, sample, options.inlier_sigmas))
      continue;
    const std::optional<Pose> pose =
        rigidAlignment({pairs[sample[0]], pairs[sample[1]], pairs[sample[2]]});
    const double cost = pose ? truncatedCost(pairs, *pose, limit, best_cost) : best_cost;
    if (cost >= best_cost)
      continue;
    best_cost = cost;
    best = pose;
    const double share = 1 - best_cost / worst_cost;
    const double all_inliers = std::min(1 - 1e-12, share * share * share);
    needed = std::max(MIN_SAMPLES, std::log(1 - options.confidence) / std::log1p(-all_inliers));
  }
  return best;
}

/** Reweighted least squares with Tukey's biweight over all pairs. */
std::optional<Pose>
refine(const std::vector<PointPair>& pairs, Pose pose, double limit)
{
  std::vector<double> weights(pairs.size());
  for (int k = 0; k < REWEIGHTINGS; ++k) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double inside = std::max(0.0, 1 - squaredSigmas(pose, pairs[i]) / limit);
      weights[i] = pairs[i].weight * inside * inside;
    }
    const std::optional<Pose> next = rigidAlignment(pairs, weights);
    if (!next)
      return std::nullopt;
    const bool settled = logarithm(pose.inverse() * *next).norm() < 1e-9;
    pose = *next;
    if (settled)
      break;
  }
  return pose;
}

/** The inliers must not lie on a line within their errors, or the rotation about it is free. */
bool
spansAPlane(const std::vector<PointPair>& pairs, const std::vector<std::size_t>& inliers)
{
  if (inliers.size() < 3)
    return false;
  const double share = 1 / double(inliers.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double variance = 0;
  for (const std::size_t i : inliers) {
    mean += share * pairs[i].source;
    variance += share / pairs[i].weight;
  }
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::size_t i : inliers) {
    const Eigen::Vector3d d = pairs[i].source - mean;
    scatter += share * d * d.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues()[1] > 4 * variance;
}

/** Robust standard deviation, in units of the expected one, of 3-vectors with these squared
 *  normalised lengths; at least 1. The median of chi-squared with 3 degrees is 2.366. */
double
observedScale(std::vector<double> squared)
{
  const auto middle = squared.begin() + std::ptrdiff_t(squared.size() / 2);
  std::nth_element(squared.begin(), middle, squared.end());
  return std::max(1.0, std::sqrt(*middle / 2.366));
}

/** Sets rmse and scale. */
void
measureResiduals(const std::vector<PointPair>& pairs, RigidAlignment& alignment)
{
  double sum = 0;
  std::vector<double> squared_sigmas;
  for (const std::size_t i : alignment.inliers) {
    const double squared =
        (alignment.target_from_source * pairs[i].source - pairs[i].target).squaredNorm();
    sum += squared;
    squared_sigmas.push_back(pairs[i].weight * squared);
  }
  alignment.rmse = std::sqrt(sum / double(alignment.inliers.size()));
  alignment.scale = observedScale(std::move(squared_sigmas));
}

} // namespace

bool
RigidAlignmentOptions::isValid(std::string* error) const
{
  const char* reason = !(std::isfinite(inlier_sigmas) && inlier_sigmas > 0)
                           ? "inlier_sigmas must be > 0"
                       : max_samples < 1                     ? "max_samples must be >= 1"
                       : !(confidence > 0 && confidence < 1) ? "confidence must lie in (0, 1)"
                                                             : nullptr;
  if (reason && error)
    *error = reason;
  return !reason;
}

std::optional<Pose>
rigidAlignment(const std::vector<PointPair>& pairs, const std::vector<double>& weights)
{
  double sum = 0;
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero(), target_mean = source_mean;
  const auto weight = [&](std::size_t i) { return weights.empty() ? pairs[i].weight : weights[i]; };
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    sum += weight(i);
    source_mean += weight(i) * pairs[i].source;
    target_mean += weight(i) * pairs[i].target;
  }
  if (!(sum > 0))
    return std::nullopt;
  source_mean /= sum;
  target_mean /= sum;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i)
    covariance += weight(i) / sum * (pairs[i].target - target_mean) *
                  (pairs[i].source - source_mean).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d values = svd.singularValues();
  if (values[1] < 1e-4 * values[0] || !(values[0] > 0))
    return std::nullopt;
  Eigen::Vector3d sign(1, 1, 1);
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0)
    sign[2] = -1;
  Pose pose = Pose::Identity();
  pose.linear() = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  pose.translation() = target_mean - pose.linear() * source_mean;
  return pose;
}

RigidAlignment
robustRigidAlignment(const std::vector<PointPair>& pairs, const RigidAlignmentOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("robustRigidAlignment: " + error);
  if (pairs.size() < 3)
    return {};
  const double limit = options.inlier_sigmas * options.inlier_sigmas;
  std::optional<Pose> pose = sampleConsensus(pairs, options);
  if (pose)
    pose = refine(pairs, *pose, limit);
  if (!pose)
    return {};
  RigidAlignment result;
  result.target_from_source = *pose;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (squaredSigmas(*pose, pairs[i]) <= limit)
      result.inliers.push_back(i);
  result.success = spansAPlane(pairs, result.inliers);
  if (result.success)
    measureResiduals(pairs, result);
  return result;
}

} // namespace bundle_icp
