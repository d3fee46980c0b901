// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/color_gains.h"

#include <bundle_icp/common/exceptions.h>

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

namespace bundle_icp {
namespace {

struct Sample {
  int frame;
  double log_color;
  double weight;
};

using Samples = std::vector<Sample>; ///< of one point

/** Maximum number of samples of a point: the equations grow with the square of the number, but more
 *  samples tell hardly more. */
constexpr std::size_t MAX_SAMPLES = 30;

/** At most MAX_SAMPLES of a point's samples, evenly distributed. Where they begin differs from one
 *  point to the next: else a frame might be left out of all points that the same frames see. */
Samples
thinned(Samples samples, std::size_t point)
{
  if (samples.size() <= MAX_SAMPLES)
    return samples;
  const std::size_t begin = std::uint32_t(point * 0x9e3779b1u) % samples.size();
  for (std::size_t k = 0; k < MAX_SAMPLES; ++k)
    samples[k] = samples[(k * samples.size() + begin) / MAX_SAMPLES];
  samples.resize(MAX_SAMPLES);
  return samples;
}

/** Samples of one channel for each point. Channels are separate, because each clips by itself. */
std::vector<Samples>
samplesOf(const std::vector<ColorObservation>& observations, int channel)
{
  constexpr int darkest = 10, brightest = 245;
  std::map<std::size_t, Samples> by_point;
  for (const ColorObservation& observation : observations) {
    const int value = observation.color[channel];
    if (value >= darkest && value <= brightest)
      by_point[observation.point].push_back({int(observation.frame), std::log(double(value)), 1});
  }
  std::vector<Samples> points;
  for (auto& [point, samples] : by_point)
    if (samples.size() > 1)
      points.push_back(thinned(std::move(samples), points.size()));
  return points;
}

/** Mean of the colours after gains: the best x for given g. */
double
meanColor(const Samples& samples, const Eigen::VectorXd& gains)
{
  double sum = 0, weights = 0;
  for (const Sample& sample : samples) {
    sum += sample.weight * (sample.log_color + gains[sample.frame]);
    weights += sample.weight;
  }
  return sum / weights;
}

/** Minimises the sum over g; each point's x is eliminated. */
Eigen::VectorXd
solveGains(const std::vector<Samples>& points, std::size_t num_frames,
           const ColorGainOptions& options)
{
  const double information = 1 / (options.color_sigma * options.color_sigma);
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(Eigen::Index(num_frames));
  for (std::size_t frame = 0; frame < num_frames; ++frame)
    entries.emplace_back(int(frame), int(frame), 1 / (options.gain_sigma * options.gain_sigma));
  for (const Samples& samples : points) {
    double sum = 0, weights = 0;
    for (const Sample& sample : samples) {
      sum += sample.weight * sample.log_color;
      weights += sample.weight;
    }
    for (const Sample& a : samples) {
      right[a.frame] += information * a.weight * (sum / weights - a.log_color);
      entries.emplace_back(a.frame, a.frame, information * a.weight);
      for (const Sample& b : samples)
        if (b.frame <= a.frame)
          entries.emplace_back(a.frame, b.frame, -information * a.weight * b.weight / weights);
    }
  }
  Eigen::SparseMatrix<double> matrix(right.size(), right.size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right);
}

Eigen::VectorXd
channelGains(std::vector<Samples> points, std::size_t num_frames, const ColorGainOptions& options)
{
  Eigen::VectorXd gains;
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    gains = solveGains(points, num_frames, options);
    for (Samples& samples : points) {
      const double mean = meanColor(samples, gains);
      for (Sample& sample : samples) {
        const double error = (sample.log_color + gains[sample.frame] - mean) / options.color_sigma;
        sample.weight = 1 / (1 + error * error);
      }
    }
  }
  return gains;
}

} // namespace

bool
ColorGainOptions::isValid(std::string* error) const
{
  std::string reason;
  if (!(color_sigma >= 0.001 && color_sigma <= 1))
    reason = "color_sigma must lie in 0.001 ... 1";
  else if (!(gain_sigma >= 0.001 && gain_sigma <= 1))
    reason = "gain_sigma must lie in 0.001 ... 1";
  else if (iterations < 1 || iterations > 100)
    reason = "iterations must lie in 1 ... 100";
  if (error && !reason.empty())
    *error = "ColorGainOptions: " + reason;
  return reason.empty();
}

std::vector<Eigen::Vector3f>
estimateColorGains(const std::vector<ColorObservation>& observations, std::size_t num_frames,
                   const ColorGainOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException(error);
  for (const ColorObservation& observation : observations)
    if (observation.frame >= num_frames)
      throw BadArgumentException("estimateColorGains: observation of frame " +
                                 std::to_string(observation.frame) + " of " +
                                 std::to_string(num_frames));
  std::vector<Eigen::Vector3f> gains(num_frames, Eigen::Vector3f::Ones());
  if (num_frames == 0)
    return gains;
  for (int channel = 0; channel < 3; ++channel) {
    const Eigen::VectorXd logs =
        channelGains(samplesOf(observations, channel), num_frames, options);
    for (std::size_t frame = 0; frame < num_frames; ++frame)
      gains[frame][channel] = float(std::clamp(std::exp(logs[Eigen::Index(frame)]), 0.05, 20.0));
  }
  return gains;
}

} // namespace bundle_icp
