// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/evaluation/trajectory_error.h>

#include "evaluation/python_random.h"
#include "io/recordings/association.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <set>

namespace bundle_icp {

namespace {

using Pair = std::pair<std::size_t, std::size_t>;

constexpr std::size_t MAX_PAIRS = 10000;

std::vector<double>
stamps(const Trajectory& trajectory)
{
  std::vector<double> result;
  for (const TimedPose& pose : trajectory)
    result.push_back(pose.timestamp);
  return result;
}

// Index of the stamp closest to `time`, by the benchmark's bisection, which decides
// ties by the order of its probes.
std::size_t
closest(const std::vector<double>& times, double time)
{
  std::size_t low = 0, high = times.size(), best = 0;
  double difference = std::abs(times[0] - time);
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (std::abs(times[middle] - time) < difference) {
      difference = std::abs(times[middle] - time);
      best = middle;
    }
    if (times[middle] == time)
      return middle;
    if (times[middle] > time)
      high = middle;
    else
      low = middle + 1;
  }
  return best;
}

std::vector<Pair>
allPairs(std::size_t n)
{
  std::vector<Pair> pairs;
  if (n * n < MAX_PAIRS) {
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        pairs.emplace_back(i, j);
    return pairs;
  }
  PythonRandom random;
  for (std::size_t k = 0; k < MAX_PAIRS; ++k) {
    const std::size_t i = random.below(n);
    pairs.emplace_back(i, random.below(n));
  }
  return pairs;
}

std::vector<Pair>
pairsAtInterval(const std::vector<double>& times, RelativePoseInterval interval)
{
  const std::size_t n = times.size();
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t j = interval == RelativePoseInterval::FRAME ? std::min(i + 1, n - 1)
                                                                  : closest(times, times[i] + 1);
    if (j != n - 1)
      pairs.emplace_back(i, j);
  }
  if (pairs.size() <= MAX_PAIRS)
    return pairs;
  std::vector<Pair> sampled;
  for (const std::size_t k : PythonRandom().sample(pairs.size(), MAX_PAIRS))
    sampled.push_back(pairs[k]);
  return sampled;
}

double
medianInterval(const std::vector<double>& times)
{
  std::vector<double> intervals;
  for (std::size_t i = 1; i < times.size(); ++i)
    intervals.push_back(times[i] - times[i - 1]);
  return errorStatistics(intervals).median;
}

} // namespace

std::optional<AbsoluteTrajectoryError>
absoluteTrajectoryError(const Trajectory& truth, const Trajectory& estimate, double max_difference)
{
  const auto pairs = associate(stamps(truth), stamps(estimate), max_difference);
  if (pairs.size() < 3)
    return std::nullopt;
  Eigen::Matrix3Xd true_positions(3, pairs.size()), positions(3, pairs.size());
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    true_positions.col(k) = truth[pairs[k].first].world_from_camera.translation();
    positions.col(k) = estimate[pairs[k].second].world_from_camera.translation();
  }
  AbsoluteTrajectoryError result;
  result.truth_from_estimate.matrix() = Eigen::umeyama(positions, true_positions, false);
  std::vector<double> errors(pairs.size());
  for (std::size_t k = 0; k < pairs.size(); ++k)
    errors[k] =
        (result.truth_from_estimate * Eigen::Vector3d(positions.col(k)) - true_positions.col(k))
            .norm();
  result.translation = errorStatistics(std::move(errors));
  return result;
}

std::optional<RelativePoseError>
relativePoseError(const Trajectory& truth, const Trajectory& estimate,
                  RelativePoseInterval interval)
{
  const std::vector<double> true_times = stamps(truth), times = stamps(estimate);
  if (times.size() < 3 || true_times.size() < 2)
    return std::nullopt;
  const double most = 2 * medianInterval(true_times);
  std::vector<std::size_t> partner(times.size());
  std::vector<char> has_partner(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    partner[i] = closest(true_times, times[i]);
    has_partner[i] = std::abs(true_times[partner[i]] - times[i]) <= most;
  }

  std::vector<double> translations, rotations;
  for (const auto& [i, j] : interval == RelativePoseInterval::ALL_PAIRS
                                ? allPairs(times.size())
                                : pairsAtInterval(times, interval)) {
    if (!has_partner[i] || !has_partner[j])
      continue;
    const Pose estimated = estimate[j].world_from_camera.inverse() * estimate[i].world_from_camera;
    const Pose expected =
        truth[partner[j]].world_from_camera.inverse() * truth[partner[i]].world_from_camera;
    const Pose error = estimated.inverse() * expected;
    translations.push_back(error.translation().norm());
    rotations.push_back(rotationAngle(error));
  }
  if (translations.size() < 2)
    return std::nullopt;
  return RelativePoseError{errorStatistics(std::move(translations)),
                           errorStatistics(std::move(rotations))};
}

std::size_t
countFramesWithPose(const std::vector<double>& timestamps, const Trajectory& estimate,
                    double max_difference)
{
  const std::set<double> unique(timestamps.begin(), timestamps.end());
  return associate({unique.begin(), unique.end()}, stamps(estimate), max_difference).size();
}

} // namespace bundle_icp
