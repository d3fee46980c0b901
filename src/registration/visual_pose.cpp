// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/registration/visual_pose.h>

#include <pcl/exceptions.h>

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace bundle_icp {
namespace {

constexpr int REWEIGHTINGS = 10;
/** Probability with which RANSAC must have met a sample without outliers. */
constexpr double CONFIDENCE = 0.999;

/** Weighted rigid least squares (Umeyama 1991 without scale); unset for a degenerate
 * set. */
std::optional<Pose>
fitPose(const VisualCorrespondences& c, const std::vector<double>& weights)
{
  double sum = 0;
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero(), target_mean = source_mean;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    sum += weights[i];
    source_mean += weights[i] * c.source[i];
    target_mean += weights[i] * c.target[i];
  }
  if (!(sum > 0))
    return std::nullopt;
  source_mean /= sum;
  target_mean /= sum;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < weights.size(); ++i)
    covariance += weights[i] / sum * (c.target[i] - target_mean) *
                  (c.source[i] - source_mean).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU |
                                                              Eigen::ComputeFullV);
  // Points on a line leave the rotation about it open.
  if (svd.singularValues()[1] < 1e-4 * svd.singularValues()[0] ||
      !(svd.singularValues()[0] > 0))
    return std::nullopt;
  Eigen::Vector3d sign(1, 1, 1);
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0)
    sign[2] = -1;
  Pose pose = Pose::Identity();
  pose.linear() = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  pose.translation() = target_mean - pose.linear() * source_mean;
  return pose;
}

std::vector<double>
squaredErrors(const VisualCorrespondences& c, const Pose& pose)
{
  std::vector<double> errors(c.source.size());
  for (std::size_t i = 0; i < errors.size(); ++i)
    errors[i] = c.weights[i] * (pose * c.source[i] - c.target[i]).squaredNorm();
  return errors;
}

/** Cost of a sample's pose: squared errors, those of outliers cut off (MSAC). */
double
truncatedCost(const VisualCorrespondences& c, const Pose& pose, double limit,
              double best)
{
  double cost = 0;
  for (std::size_t i = 0; i < c.source.size() && cost < best; ++i)
    cost += std::min(limit,
                     c.weights[i] * (pose * c.source[i] - c.target[i]).squaredNorm());
  return cost;
}

std::array<std::size_t, 3>
drawSample(std::mt19937_64& random, std::size_t size)
{
  std::array<std::size_t, 3> sample;
  do
    for (std::size_t& index : sample)
      index = random() % size;
  while (sample[0] == sample[1] || sample[0] == sample[2] || sample[1] == sample[2]);
  return sample;
}

/** True when the three sides agree within noise: a rigid motion keeps distances. */
bool
keepsDistances(const VisualCorrespondences& c, const std::array<std::size_t, 3>& sample,
               double sigmas)
{
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = sample[k], j = sample[(k + 1) % 3];
    const double before = (c.source[i] - c.source[j]).norm();
    const double after = (c.target[i] - c.target[j]).norm();
    const double sigma = std::sqrt(1 / c.weights[i] + 1 / c.weights[j]);
    if (std::abs(before - after) > sigmas * sigma || before < 2 * sigma)
      return false;
  }
  return true;
}

std::optional<Pose>
sampleConsensus(const VisualCorrespondences& c, const VisualPoseOptions& options)
{
  const std::size_t n = c.source.size();
  const double limit = options.inlier_sigmas * options.inlier_sigmas;
  std::mt19937_64 random(options.seed);
  std::optional<Pose> best;
  double best_cost = static_cast<double>(n) * limit, needed = options.max_samples;
  for (int k = 0; k < options.max_samples && k < needed; ++k) {
    const auto sample = drawSample(random, n);
    if (!keepsDistances(c, sample, options.inlier_sigmas))
      continue;
    VisualCorrespondences three;
    for (const std::size_t i : sample) {
      three.source.push_back(c.source[i]);
      three.target.push_back(c.target[i]);
      three.weights.push_back(c.weights[i]);
    }
    const std::optional<Pose> pose = fitPose(three, three.weights);
    const double cost = pose ? truncatedCost(c, *pose, limit, best_cost) : best_cost;
    if (cost >= best_cost)
      continue;
    best_cost = cost;
    best = pose;
    const double share = 1 - best_cost / (static_cast<double>(n) * limit);
    const double all_inliers = std::min(1 - 1e-12, share * share * share);
    // Samples that do hit the consensus still differ in accuracy: draw at least 50.
    needed = std::max(50.0, std::log(1 - CONFIDENCE) / std::log1p(-all_inliers));
  }
  return best;
}

/** Robust standard deviation, in units of the expected one, of 3-vectors with these
 * squared normalised lengths; at least 1. The median of chi-squared with 3 degrees
 * is 2.366. */
double
observedScale(std::vector<double> squared, double limit)
{
  squared.erase(std::remove_if(squared.begin(), squared.end(),
                               [&](double e) { return e > limit; }),
                squared.end());
  if (squared.empty())
    return 1;
  const auto middle = squared.begin() + static_cast<std::ptrdiff_t>(squared.size() / 2);
  std::nth_element(squared.begin(), middle, squared.end());
  return std::max(1.0, std::sqrt(*middle / 2.366));
}

/** Reweighted least squares with Tukey's biweight over all correspondences. */
std::optional<Pose>
refine(const VisualCorrespondences& c, Pose pose, double limit)
{
  std::vector<double> weights(c.weights.size());
  for (int k = 0; k < REWEIGHTINGS; ++k) {
    const std::vector<double> errors = squaredErrors(c, pose);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const double inside = std::max(0.0, 1 - errors[i] / limit);
      weights[i] = c.weights[i] * inside * inside;
    }
    const std::optional<Pose> next = fitPose(c, weights);
    if (!next)
      return std::nullopt;
    const bool settled = logarithm(pose.inverse() * *next).norm() < 1e-9;
    pose = *next;
    if (settled)
      break;
  }
  return pose;
}

} // namespace

bool
VisualPoseOptions::isValid(std::string* error) const
{
  const bool valid = std::isfinite(inlier_sigmas) && inlier_sigmas > 0 &&
                     min_inliers >= 3 && max_samples > 0;
  if (!valid && error)
    *error = "visual pose options: inlier_sigmas and max_samples must be positive, "
             "min_inliers at least 3";
  return valid;
}

bool
isValid(const VisualCorrespondences& c, std::string* error)
{
  const auto fail = [error](const std::string& reason) {
    if (error)
      *error = "visual correspondences: " + reason;
    return false;
  };
  if (c.source.size() != c.target.size() || c.source.size() != c.weights.size())
    return fail(std::to_string(c.source.size()) + " source points, " +
                std::to_string(c.target.size()) + " target points and " +
                std::to_string(c.weights.size()) + " weights; expected equally many");
  for (std::size_t i = 0; i < c.source.size(); ++i) {
    if (!c.source[i].allFinite() || !c.target[i].allFinite())
      return fail("point " + std::to_string(i) + " is not finite");
    if (!std::isfinite(c.weights[i]) || c.weights[i] <= 0)
      return fail("weight " + std::to_string(i) + " is " +
                  std::to_string(c.weights[i]) + "; expected a positive number");
  }
  return true;
}

std::optional<VisualPose>
estimateVisualPose(const VisualCorrespondences& correspondences,
                   const VisualPoseOptions& options)
{
  std::string error;
  if (!options.isValid(&error) || !isValid(correspondences, &error))
    throw pcl::BadArgumentException("estimateVisualPose: " + error);
  if (correspondences.source.size() < options.min_inliers)
    return std::nullopt;
  const double limit = options.inlier_sigmas * options.inlier_sigmas;
  std::optional<Pose> pose = sampleConsensus(correspondences, options);
  if (pose)
    pose = refine(correspondences, *pose, limit);
  if (!pose)
    return std::nullopt;
  VisualPose result;
  result.world_from_source = *pose;
  const std::vector<double> errors = squaredErrors(correspondences, *pose);
  double sum = 0;
  for (std::size_t i = 0; i < errors.size(); ++i)
    if (errors[i] <= limit) {
      ++result.inliers;
      sum += errors[i] / correspondences.weights[i];
    }
  if (result.inliers < options.min_inliers)
    return std::nullopt;
  result.rmse = std::sqrt(sum / static_cast<double>(result.inliers));
  result.scale = observedScale(errors, limit);
  return result;
}

} // namespace bundle_icp
