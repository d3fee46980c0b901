// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/frame_motions.h"

#include "common/by_time.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Largest time to the nearest neighbour on either side at the rate of a video [s]: hands tremble
 *  some ten times a second. */
constexpr double DENSE_STEP = 0.05;
/** Largest time to the nearest two neighbours on either side where frames are further apart [s]. */
constexpr double REACH = 0.8;
/** Stamps closer than this count as one stamp, and give no speed [s]. */
constexpr double SAME_TIME = 1e-3;
constexpr std::size_t MAX_PER_SIDE = 2;
constexpr int DEGREE = 3;
/** Motions are extrapolated by at most so many times the step that they were seen over. */
constexpr double MAX_EXTRAPOLATION = 3;

struct Sample {
  double time;       ///< relative to the frame [s]
  Vector6d position; ///< motion of camera_from_world since the frame
};

/** Slope at 0 of the polynomial through 0 that fits the samples best. */
Vector6d
slope(const std::vector<Sample>& samples)
{
  if (samples.empty())
    return Vector6d::Zero();
  double span = 0;
  for (const Sample& sample : samples)
    span = std::max(span, std::abs(sample.time));
  if (!(span > 0))
    return Vector6d::Zero();
  const int degree = std::min<int>(DEGREE, int(samples.size()));
  Eigen::MatrixXd powers(samples.size(), degree), positions(samples.size(), 6);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    for (int d = 0; d < degree; ++d)
      powers(Eigen::Index(k), d) = std::pow(samples[k].time / span, d + 1);
    positions.row(Eigen::Index(k)) = samples[k].position.transpose();
  }
  const Eigen::MatrixXd coefficients = powers.colPivHouseholderQr().solve(positions);
  return coefficients.row(0).transpose() / span;
}

} // namespace

Pose
extrapolatedPose(const ImageGraph& graph, const SparseModel& model, std::size_t before,
                 std::size_t last, std::size_t frame)
{
  const Pose& pose = model.worldFromCamera(last);
  const double step = graph.timestamp(last) - graph.timestamp(before);
  const double ahead = graph.timestamp(frame) - graph.timestamp(last);
  if (step == 0 || !(std::abs(ahead / step) < MAX_EXTRAPOLATION))
    return pose;
  const Pose motion = model.worldFromCamera(before).inverse() * pose;
  return pose * increment(ahead / step * logarithm(motion));
}

void
estimateMotions(const ImageGraph& graph, int component, SparseModel& model)
{
  const std::vector<std::size_t> by_time = byTime(graph, model.registeredFrames(component));
  const int count = int(by_time.size());
  for (int k = 0; k < count; ++k) {
    const std::size_t frame = by_time[std::size_t(k)];
    std::vector<Sample> samples;
    for (const int direction : {-1, 1}) {
      std::size_t found = 0;
      for (int j = k + direction; j >= 0 && j < count; j += direction) {
        const std::size_t other = by_time[std::size_t(j)];
        const double time = graph.timestamp(other) - graph.timestamp(frame);
        if (std::abs(time) < SAME_TIME)
          continue;
        if (std::abs(time) > REACH || found == MAX_PER_SIDE ||
            (found > 0 && std::abs(samples.back().time) < DENSE_STEP))
          break;
        samples.push_back({time, logarithm(model.worldFromCamera(other).inverse() *
                                           model.worldFromCamera(frame))});
        ++found;
      }
    }
    model.setMotion(frame, slope(samples));
  }
}

} // namespace bundle_icp
