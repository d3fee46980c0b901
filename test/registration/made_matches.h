// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "registration/normal_equations.h"
#include "scenes.h"

#include <random>
#include <vector>

/** Matches as tests make them, for normal equations without clouds. */
namespace bundle_icp::test {

/** A point about the centre, at a distance from its match along a unit normal. */
struct MadeMatch {
  Eigen::Vector3d point, normal;
  double residual = 0;
  double sigma = 0.01;
  Eigen::Vector3d source_normal = normal;
};

inline Matches
toMatches(const std::vector<MadeMatch>& made)
{
  Matches matches;
  matches.resize(made.size());
  const auto set = [](const Eigen::Vector3d& v, std::size_t i, std::vector<float>& x,
                      std::vector<float>& y, std::vector<float>& z) {
    x[i] = float(v.x());
    y[i] = float(v.y());
    z[i] = float(v.z());
  };
  for (std::size_t i = 0; i < made.size(); ++i) {
    set(made[i].point, i, matches.px, matches.py, matches.pz);
    set(made[i].normal, i, matches.nx, matches.ny, matches.nz);
    set(made[i].source_normal, i, matches.sx, matches.sy, matches.sz);
    matches.residual[i] = float(made[i].residual);
    matches.inverse_sigma[i] = float(1 / made[i].sigma);
    matches.target[i] = int(i);
  }
  return matches;
}

inline Eigen::Vector3d
randomVector(std::mt19937& random)
{
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return {x, y, z};
}

/** Points all around with normals in all directions, their residuals of `errors` sigmas. */
inline std::vector<MadeMatch>
randomMatches(std::size_t size, unsigned seed, double errors)
{
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> sigma(0.005, 0.02);
  std::vector<MadeMatch> made;
  for (std::size_t i = 0; i < size; ++i) {
    MadeMatch match{randomVector(random), randomVector(random).normalized()};
    match.source_normal = match.normal;
    match.sigma = sigma(random);
    match.residual = errors * match.sigma * normal(random);
    made.push_back(match);
  }
  return made;
}

/** The matrix that takes motions about one point to those about another: a turn about `from` is a
 *  turn about `to` and a translation. */
inline Matrix6d
motionsAbout(const Eigen::Vector3d& from, const Eigen::Vector3d& to)
{
  Matrix6d change = Matrix6d::Identity();
  change.bottomLeftCorner<3, 3>() = crossMatrix(from - to);
  return change;
}

/** The same motion in turned axes. */
inline Matrix6d
turned(const Eigen::Matrix3d& rotation)
{
  Matrix6d change = Matrix6d::Zero();
  change.topLeftCorner<3, 3>() = change.bottomRightCorner<3, 3>() = rotation;
  return change;
}

/** Largest difference, as a share of the largest entry. */
template <typename A, typename B>
double
difference(const A& actual, const B& expected)
{
  return (actual - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

} // namespace bundle_icp::test
