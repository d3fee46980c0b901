// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/trajectory_smoothing.h"

#include <Eigen/Dense>

#include <cmath>

namespace bundle_icp {
namespace {

/** Error of the state: of pose and velocity, each rotation first, along the axes of the
 * world. */
using StateVector = Eigen::Matrix<double, 12, 1>;
using StateMatrix = Eigen::Matrix<double, 12, 12>;

/** Prior variance of a hand's velocity [rad^2/s^2, m^2/s^2]. */
constexpr double VELOCITY_VARIANCE = 1;
/** Rounds of weighting, each with the residuals of the one before. */
constexpr int ROUNDS = 3;
/** Scale of the Cauchy loss on a measurement's distance from the smoothed pose, in
 * sigmas. */
constexpr double LOSS_SCALE = 2;
/** A number of the prior, and the bounds between which it is searched. */
struct Searched {
  double MotionPrior::*value;
  double low, high;
};
constexpr Searched SEARCHED[] = {{&MotionPrior::rotation, 1e-4, 1e4},
                                 {&MotionPrior::translation, 1e-4, 1e4},
                                 {&MotionPrior::noise, 1, 100}};
/** Prior standard deviation of the logarithm of MotionPrior::noise: a factor of two. Without it,
 *  motion that cannot be predicted would pass for noise. */
constexpr double NOISE_DEVIATION = 0.7;
/** Each is found to this factor, in turns. */
constexpr double PRECISION = 1.3;
constexpr int SEARCH_ROUNDS = 3;

/** Pose with rotation and position apart: they move as they add. */
struct State {
  Pose pose = Pose::Identity();
  Vector6d velocity = Vector6d::Zero();

  void
  move(const StateVector& error)
  {
    const Eigen::Vector3d position = pose.translation() + error.segment<3>(3);
    pose = increment((Vector6d() << error.head<3>(), Eigen::Vector3d::Zero()).finished()) * pose;
    pose.translation() = position;
    velocity += error.tail<6>();
  }
};

/** Error that takes one pose to another. */
Vector6d
difference(const Pose& to, const Pose& from)
{
  Pose rotation = Pose::Identity();
  rotation.linear() = to.linear() * from.linear().transpose();
  Vector6d error = logarithm(rotation);
  error.tail<3>() = to.translation() - from.translation();
  return error;
}

struct Step {
  State state, predicted;
  StateMatrix covariance = StateMatrix::Zero(), predicted_covariance = StateMatrix::Zero();
  double dt = 0;
};

StateMatrix
transition(double dt)
{
  StateMatrix matrix = StateMatrix::Identity();
  matrix.topRightCorner<6, 6>().diagonal().setConstant(dt);
  return matrix;
}

/** Filters forwards. \return the logarithm of the likelihood, up to a constant */
double
filter(const std::vector<PoseMeasurement>& measurements, const std::vector<double>& weights,
       const MotionPrior& prior, std::vector<Step>& steps)
{
  Vector6d density;
  density << Eigen::Vector3d::Constant(prior.rotation),
      Eigen::Vector3d::Constant(prior.translation);
  steps.resize(measurements.size());
  double likelihood = 0;
  for (std::size_t k = 0; k < measurements.size(); ++k) {
    const Matrix6d noise = measurements[k].covariance * (prior.noise / weights[k]);
    Step& step = steps[k];
    if (k == 0) {
      step.state = {measurements[k].world_from_camera, Vector6d::Zero()};
      step.covariance.setZero();
      step.covariance.topLeftCorner<6, 6>() = noise;
      step.covariance.bottomRightCorner<6, 6>().diagonal().setConstant(VELOCITY_VARIANCE);
      continue;
    }
    const Step& last = steps[k - 1];
    const double dt = step.dt = measurements[k].time - measurements[k - 1].time;
    step.predicted = last.state;
    step.predicted.move((StateVector() << dt * last.state.velocity, Vector6d::Zero()).finished());
    const StateMatrix forwards = transition(dt);
    StateMatrix covariance = forwards * last.covariance * forwards.transpose();
    covariance.topLeftCorner<6, 6>().diagonal() += density * (dt * dt * dt / 3);
    covariance.topRightCorner<6, 6>().diagonal() += density * (dt * dt / 2);
    covariance.bottomLeftCorner<6, 6>().diagonal() += density * (dt * dt / 2);
    covariance.bottomRightCorner<6, 6>().diagonal() += density * dt;
    step.predicted_covariance = covariance;

    const Vector6d innovation = difference(measurements[k].world_from_camera, step.predicted.pose);
    const Matrix6d innovation_covariance = covariance.topLeftCorner<6, 6>() + noise;
    const Eigen::LDLT<Matrix6d> ldlt(innovation_covariance);
    likelihood -= 0.5 * (innovation.dot(ldlt.solve(innovation)) +
                         ldlt.vectorD().array().max(1e-300).log().sum());
    const Eigen::Matrix<double, 12, 6> gain = ldlt.solve(covariance.topRows<6>()).transpose();
    step.state = step.predicted;
    step.state.move(gain * innovation);
    covariance -= gain * covariance.topRows<6>().eval();
    step.covariance = 0.5 * (covariance + covariance.transpose());
  }
  return likelihood;
}

/** Backwards: what later measurements say of earlier states. */
void
smooth(std::vector<Step>& steps)
{
  for (std::size_t k = steps.size() - 1; k-- > 0;) {
    const Step& next = steps[k + 1];
    const StateMatrix gain = next.predicted_covariance.ldlt()
                                 .solve(transition(next.dt) * steps[k].covariance)
                                 .transpose();
    StateVector error;
    error << difference(next.state.pose, next.predicted.pose),
        next.state.velocity - next.predicted.velocity;
    steps[k].state.move(gain * error);
    const StateMatrix covariance =
        steps[k].covariance +
        gain * (next.covariance - next.predicted_covariance) * gain.transpose();
    steps[k].covariance = 0.5 * (covariance + covariance.transpose());
  }
}

/** Of the prior, given the measurements. */
double
logLikelihood(const std::vector<PoseMeasurement>& measurements, const MotionPrior& prior)
{
  std::vector<Step> steps;
  const double surprise = std::log(prior.noise) / NOISE_DEVIATION;
  return filter(measurements, std::vector<double>(measurements.size(), 1), prior, steps) -
         0.5 * surprise * surprise;
}

template <class Function>
double
goldenSectionMaximum(const Function& function, double low, double high, double precision)
{
  const double ratio = (std::sqrt(5.0) - 1) / 2;
  double left = high - ratio * (high - low), right = low + ratio * (high - low);
  double at_left = function(left), at_right = function(right);
  while (high - low > precision)
    if (at_left > at_right) {
      high = right;
      right = left;
      at_right = at_left;
      left = high - ratio * (high - low);
      at_left = function(left);
    }
    else {
      low = left;
      left = right;
      at_left = at_right;
      right = low + ratio * (high - low);
      at_right = function(right);
    }
  return 0.5 * (low + high);
}

} // namespace

MotionPrior
estimateMotionPrior(const std::vector<PoseMeasurement>& measurements)
{
  MotionPrior prior;
  for (int round = 0; round < SEARCH_ROUNDS; ++round)
    for (const Searched& searched : SEARCHED)
      prior.*searched.value = std::exp(goldenSectionMaximum(
          [&](double logarithm) {
            MotionPrior trial = prior;
            trial.*searched.value = std::exp(logarithm);
            return logLikelihood(measurements, trial);
          },
          std::log(searched.low), std::log(searched.high), std::log(PRECISION)));
  return prior;
}

std::vector<PoseEstimate>
smoothTrajectory(const std::vector<PoseMeasurement>& measurements, const MotionPrior& prior)
{
  std::vector<Step> steps;
  std::vector<double> weights(measurements.size(), 1);
  for (int round = 0; round < ROUNDS && !measurements.empty(); ++round) {
    filter(measurements, weights, prior, steps);
    smooth(steps);
    for (std::size_t k = 0; k < steps.size(); ++k) {
      const Vector6d error = difference(measurements[k].world_from_camera, steps[k].state.pose);
      const double squared =
          error.dot(measurements[k].covariance.ldlt().solve(error)) / (6 * prior.noise);
      weights[k] = 1 / (1 + squared / (LOSS_SCALE * LOSS_SCALE));
    }
  }
  std::vector<PoseEstimate> poses;
  for (std::size_t k = 0; k < steps.size(); ++k)
    poses.push_back({steps[k].state.pose, measurements[k].depth_error,
                     steps[k].covariance.topLeftCorner<6, 6>()});
  return poses;
}

} // namespace bundle_icp
