// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/focal_length.h"

#include "common/parallel.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace bundle_icp {
namespace {

/** Pairs that are looked at, those that say most: beyond so many the deviation hardly falls. */
constexpr std::size_t MAX_PAIRS = 120;
/** Pairs of one frame among them. */
constexpr std::size_t MAX_PAIRS_OF_FRAME = 8;
/** Fewer pairs say nothing of how far they contradict each other. */
constexpr std::size_t MIN_PAIRS = 5;
/** Matches that a pair needs for one motion. */
constexpr std::size_t MIN_MATCHES = 20;
/** Steps between the focal lengths that are tried: each is close enough to its neighbours for the
 *  refinement to bridge them. */
constexpr double GRID_STEP = 1.08;
/** Squared distance in sigmas at which a match has a quarter of its weight. */
constexpr double LOSS_SCALE = 12;
constexpr int POSE_ITERATIONS = 4, FOCAL_ITERATIONS = 8;
/** Larger deviations do not determine a focal length: it could be that of another camera. */
constexpr double MAX_DEVIATION = 0.05;
/** Of the logarithm of the focal length in one iteration. */
constexpr double MAX_STEP = 0.05;

/** Of a pair: motion and DepthError of either frame. Of the camera: logarithm of the focal length,
 *  shift of the axis [x / z, y / z], radial distortion, and shares by which depth is too large: per
 *  metre, along x / z, along y / z, with the squared distance from the axis. */
constexpr int NUM_POSE = 6, NUM_OF_PAIR = 12, NUM_OF_CAMERA = 9, NUM_ALL = 21;
using NormalMatrix = Eigen::Matrix<double, NUM_ALL, NUM_ALL>;
using NormalVector = Eigen::Matrix<double, NUM_ALL, 1>;
using CameraMatrix = Eigen::Matrix<double, NUM_OF_CAMERA, NUM_OF_CAMERA>;
using CameraVector = Eigen::Matrix<double, NUM_OF_CAMERA, 1>;
using PairMatrix = Eigen::Matrix<double, NUM_OF_PAIR, NUM_OF_PAIR>;

/** The first so many are fitted. Errors of depth look too much like a wrong lens to be told apart;
 *  they only count in the deviation. */
constexpr int NUM_FITTED = 5, NUM_CONSIDERED = 4;
using LensMatrix = Eigen::Matrix<double, NUM_FITTED, NUM_FITTED>;
using LensVector = Eigen::Matrix<double, NUM_FITTED, 1>;

/** What cameras are: deviations of the axis from the middle of the image, of the distortion, and of
 *  depth. */
CameraMatrix
cameraPrior()
{
  CameraVector deviations;
  deviations << std::numeric_limits<double>::infinity(), 0.03, 0.03, 0.3, 0.6, 0.01, 0.01, 0.01,
      0.02;
  return deviations.cwiseAbs2().cwiseInverse().asDiagonal();
}

/** A matched feature in its camera. */
struct Measured {
  Eigen::Vector2d ray = Eigen::Vector2d::Zero(); ///< x / z, y / z with the nominal focal length
  double depth = 0, depth_sigma = 0;             ///< [m]
  double image_sigma = 0;                        ///< of the features' noise [m]
  double ray_sigma = 0;                          ///< of x / z and y / z
};

struct Correspondence {
  Measured first, second;
};

/** What a pair says of the camera, when all else follows. */
struct Evidence {
  double cost = 0;
  CameraVector gradient = CameraVector::Zero();
  CameraMatrix information = CameraMatrix::Zero();
};

/** One pair of frames with the state that is fitted to it. */
struct Pair {
  std::size_t first = 0, second = 0;
  std::vector<Correspondence> matches;
  Pose first_from_second = Pose::Identity();
  Eigen::Matrix<double, 6, 1> errors = Eigen::Matrix<double, 6, 1>::Zero();
  bool is_placed = false;
};

Measured
measured(const Features& features, std::size_t j, const CameraIntrinsics& camera)
{
  Measured m;
  m.ray = {(features.pixels[j].x() - camera.cx) / camera.fx,
           (features.pixels[j].y() - camera.cy) / camera.fy};
  m.depth = features.depths[j];
  m.depth_sigma = features.depth_sigmas[j];
  m.image_sigma = camera.depth_noise.sigma(m.depth);
  m.ray_sigma = features.pixel_sigmas[j] / camera.fx;
  return m;
}

/** A measured point by a camera, its covariance and its derivatives. */
struct Point {
  Eigen::Vector3d position;
  Eigen::Matrix3d covariance;
  Eigen::Matrix3d by_error; ///< by the DepthError of its frame
  Eigen::Matrix<double, 3, NUM_OF_CAMERA> by_camera;
};

Point
pointOf(const Measured& m, const Eigen::Vector3d& error, const CameraVector& camera)
{
  const double scale = std::exp(-camera[0]);
  const Eigen::Vector2d image = m.ray - camera.segment<2>(1);
  const double r2 = image.squaredNorm();
  const double radial = 1 - camera[3] * r2 - camera[4] * r2 * r2;
  Eigen::Vector3d ray(0, 0, 1);
  ray.head<2>() = scale * radial * image;
  const Eigen::Vector3d shared(1, m.ray.x(), m.ray.y());
  Eigen::Vector4d wrong(m.depth, m.ray.x(), m.ray.y(), m.ray.squaredNorm());
  wrong *= m.depth;
  const double z = m.depth - m.image_sigma * error.dot(shared) - wrong.dot(camera.tail<4>());
  Point point;
  point.position = z * ray;
  const double lateral = z * m.ray_sigma * scale;
  point.covariance = m.depth_sigma * m.depth_sigma * ray * ray.transpose();
  point.covariance(0, 0) += lateral * lateral;
  point.covariance(1, 1) += lateral * lateral;
  point.by_error = -m.image_sigma * ray * shared.transpose();
  point.by_camera.setZero();
  point.by_camera.topLeftCorner<2, 1>() = -point.position.head<2>();
  point.by_camera.block<2, 2>(0, 1) =
      -z * scale *
      (radial * Eigen::Matrix2d::Identity() -
       (2 * camera[3] + 4 * camera[4] * r2) * image * image.transpose());
  point.by_camera.block<2, 1>(0, 3) = -z * scale * r2 * image;
  point.by_camera.block<2, 1>(0, 4) = -z * scale * r2 * r2 * image;
  point.by_camera.rightCols<4>() = -ray * wrong.transpose();
  return point;
}

/** Normal equations of a pair at its state; each match counts with Geman and McClure's weight. */
double
addUp(const Pair& pair, const CameraVector& camera, NormalMatrix& normal, NormalVector& gradient)
{
  normal.setZero();
  gradient.setZero();
  // A DepthError has a deviation of 1 by its definition.
  normal.block<6, 6>(NUM_POSE, NUM_POSE).setIdentity();
  gradient.segment<6>(NUM_POSE) = pair.errors;
  double cost = 0.5 * pair.errors.squaredNorm();
  const Eigen::Matrix3d rotation = pair.first_from_second.linear();
  for (const Correspondence& match : pair.matches) {
    const Point first = pointOf(match.first, pair.errors.head<3>(), camera);
    const Point second = pointOf(match.second, pair.errors.tail<3>(), camera);
    const Eigen::Vector3d turned = rotation * second.position;
    const Eigen::Vector3d distance = turned + pair.first_from_second.translation() - first.position;
    const Eigen::LLT<Eigen::Matrix3d> root(first.covariance +
                                           rotation * second.covariance * rotation.transpose());
    Eigen::Matrix<double, 3, NUM_ALL> jacobian;
    jacobian << -crossMatrix(turned), Eigen::Matrix3d::Identity(), -first.by_error,
        rotation * second.by_error, rotation * second.by_camera - first.by_camera;
    const Eigen::Vector3d r = root.matrixL().solve(distance);
    root.matrixL().solveInPlace(jacobian);
    const double share = 1 / (1 + r.squaredNorm() / LOSS_SCALE);
    cost += 0.5 * r.squaredNorm() * share;
    normal.noalias() += share * share * jacobian.transpose() * jacobian;
    gradient.noalias() += share * share * jacobian.transpose() * r;
  }
  return cost;
}

/** Fits motion and depth errors with a camera. */
Evidence
fit(Pair& pair, const CameraVector& camera)
{
  NormalMatrix normal;
  NormalVector gradient;
  for (int i = 0; i < POSE_ITERATIONS; ++i) {
    addUp(pair, camera, normal, gradient);
    const PairMatrix own = normal.topLeftCorner<NUM_OF_PAIR, NUM_OF_PAIR>();
    const Eigen::Matrix<double, NUM_OF_PAIR, 1> step =
        own.ldlt().solve(-gradient.head<NUM_OF_PAIR>());
    const Pose motion = increment(step.head<6>());
    pair.first_from_second.linear() = motion.linear() * pair.first_from_second.linear();
    pair.first_from_second.translation() += motion.translation();
    pair.errors += step.tail<6>();
  }
  Evidence evidence;
  evidence.cost = addUp(pair, camera, normal, gradient);
  const auto coupling = normal.topRightCorner<NUM_OF_PAIR, NUM_OF_CAMERA>();
  const PairMatrix own = normal.topLeftCorner<NUM_OF_PAIR, NUM_OF_PAIR>();
  const Eigen::Matrix<double, NUM_OF_PAIR, NUM_OF_CAMERA> along = own.ldlt().solve(coupling);
  evidence.information =
      normal.bottomRightCorner<NUM_OF_CAMERA, NUM_OF_CAMERA>() - coupling.transpose() * along;
  evidence.gradient =
      gradient.tail<NUM_OF_CAMERA>() - along.transpose() * gradient.head<NUM_OF_PAIR>();
  return evidence;
}

/** The motion that most matches support at a focal length. */
bool
place(Pair& pair, const CameraVector& camera)
{
  std::vector<PointPair> points;
  for (const Correspondence& match : pair.matches) {
    const Point first = pointOf(match.first, Eigen::Vector3d::Zero(), camera);
    const Point second = pointOf(match.second, Eigen::Vector3d::Zero(), camera);
    points.push_back({second.position, first.position,
                      3 / (first.covariance.trace() + second.covariance.trace())});
  }
  const RigidAlignment alignment = robustRigidAlignment(points);
  pair.is_placed = alignment.success && alignment.inliers.size() >= MIN_MATCHES;
  pair.first_from_second = alignment.target_from_source;
  pair.errors.setZero();
  return pair.is_placed;
}

/** Pairs that say most of the focal length, none of them of too few frames. */
std::vector<Pair>
choose(std::vector<Pair> pairs, int num_threads)
{
  std::vector<double> information(pairs.size(), 0);
  parallelFor(pairs.size(), num_threads, {}, [&](std::size_t k) {
    if (pairs[k].matches.size() >= MIN_MATCHES && place(pairs[k], CameraVector::Zero()))
      information[k] = fit(pairs[k], CameraVector::Zero()).information(0, 0);
  });
  std::vector<std::size_t> order(pairs.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return information[a] > information[b]; });
  std::vector<Pair> chosen;
  std::map<std::size_t, std::size_t> count;
  for (const std::size_t k : order) {
    Pair& pair = pairs[k];
    if (chosen.size() == MAX_PAIRS || !(information[k] > 0))
      break;
    if (count[pair.first] >= MAX_PAIRS_OF_FRAME || count[pair.second] >= MAX_PAIRS_OF_FRAME)
      continue;
    ++count[pair.first];
    ++count[pair.second];
    chosen.push_back(std::move(pair));
  }
  return chosen;
}

double
costAt(std::vector<Pair>& pairs, double factor, int num_threads)
{
  std::vector<double> costs(pairs.size());
  CameraVector camera = CameraVector::Zero();
  camera[0] = std::log(factor);
  parallelFor(pairs.size(), num_threads, {}, [&](std::size_t k) {
    // Without a motion no match fits.
    costs[k] = place(pairs[k], camera) ? fit(pairs[k], camera).cost
                                       : 0.5 * LOSS_SCALE * double(pairs[k].matches.size());
  });
  return std::accumulate(costs.begin(), costs.end(), 0.0);
}

/** Variance of the focal length's logarithm. Pairs that share a frame are not independent (Aronow,
 *  Samii, Assenova, Political Analysis 2015). What depth may be wrong by comes on top. */
double
varianceOf(const std::vector<Pair>& pairs, const std::vector<Evidence>& evidence,
           const CameraMatrix& information)
{
  const LensMatrix inverse = information.topLeftCorner<NUM_FITTED, NUM_FITTED>().inverse();
  const Eigen::Matrix<double, 1, NUM_CONSIDERED> by_depth =
      inverse.row(0) * information.topRightCorner<NUM_FITTED, NUM_CONSIDERED>();
  const double of_depth = by_depth.cwiseAbs2().dot(
      cameraPrior().diagonal().tail<NUM_CONSIDERED>().cwiseInverse().transpose());

  std::map<std::size_t, double> of_frame;
  double squares = 0;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const double step = inverse.row(0).dot(evidence[k].gradient.head<NUM_FITTED>());
    of_frame[pairs[k].first] += step;
    of_frame[pairs[k].second] += step;
    squares += step * step;
  }
  double sum = -squares;
  for (const auto& [frame, step] : of_frame)
    sum += step * step;
  // The first holds for many frames; no sample says less than its own noise.
  return of_depth + std::max({sum, squares, inverse(0, 0)});
}

} // namespace

FocalLength
estimateFocalLength(const std::vector<Features>& features, const std::vector<MatchedFrames>& pairs,
                    const CameraIntrinsics& camera, double lowest, double highest, int num_threads)
{
  std::vector<Pair> all;
  for (const MatchedFrames& frames : pairs) {
    all.push_back({frames.first, frames.second, {}});
    const Features &first = features[frames.first], &second = features[frames.second];
    for (const FeatureMatch& m : frames.matches)
      if (first.hasDepth(m.first) && second.hasDepth(m.second))
        all.back().matches.push_back(
            {measured(first, m.first, camera), measured(second, m.second, camera)});
  }
  std::vector<Pair> chosen = choose(std::move(all), num_threads);
  FocalLength result;
  result.num_pairs = chosen.size();
  if (chosen.size() < MIN_PAIRS)
    return result;
  double least = std::numeric_limits<double>::infinity();
  const int steps = std::max(1, int(std::ceil(std::log(highest / lowest) / std::log(GRID_STEP))));
  for (int i = 0; i <= steps; ++i) {
    const double factor = lowest * std::pow(highest / lowest, double(i) / steps);
    const double cost = costAt(chosen, factor, num_threads);
    if (cost < least) {
      least = cost;
      result.factor = factor;
    }
  }
  costAt(chosen, result.factor, num_threads); // the motions at the best one
  std::vector<Evidence> evidence(chosen.size());
  CameraVector lens = CameraVector::Zero();
  lens[0] = std::log(result.factor);
  CameraMatrix information;
  for (int i = 0; i < FOCAL_ITERATIONS; ++i) {
    parallelFor(chosen.size(), num_threads, {}, [&](std::size_t k) {
      evidence[k] = chosen[k].is_placed ? fit(chosen[k], lens) : Evidence();
    });
    information = cameraPrior();
    CameraVector zero = lens;
    zero[0] = 0;
    CameraVector gradient = information * zero;
    for (const Evidence& e : evidence) {
      gradient += e.gradient;
      information += e.information;
    }
    if (!(information(0, 0) > 0))
      return result;
    const LensMatrix fitted = information.topLeftCorner<NUM_FITTED, NUM_FITTED>();
    const LensVector step = fitted.ldlt().solve(-gradient.head<NUM_FITTED>());
    lens.head<NUM_FITTED>() += std::min(1.0, MAX_STEP / std::abs(step[0])) * step;
    lens[0] = std::clamp(lens[0], std::log(lowest), std::log(highest));
  }
  result.factor = std::exp(lens[0]);
  result.deviation = std::sqrt(varianceOf(chosen, evidence, information));
  result.is_determined =
      result.deviation < MAX_DEVIATION && result.factor > lowest && result.factor < highest;
  return result;
}

} // namespace bundle_icp
