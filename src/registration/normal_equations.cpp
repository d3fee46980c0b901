// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/normal_equations.h"

#include "common/parallel.h"
#include "common/simd.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Normalised distance beyond which a correspondence is an outlier. */
constexpr double OUTLIER_SIGMAS = 4;
/** Fewer tiles do not show how errors scatter. */
constexpr double MIN_TILES = 12;
/** Of a measurement, over that which the noise model expects. */
constexpr double LEAST_VARIANCE = 0.25;

/** Entries that one task sums. Fixed, so that sums do not depend on the number of
 * threads. */
constexpr std::size_t CHUNK = 4096;
constexpr std::size_t LANES = Matches::LANES;
/** 21 entries of H, 6 of g, 21 of the structure, and 6 further sums. */
constexpr std::size_t SUMS = 54;

struct Sums {
  double value[SUMS] = {};
};

/** Derivatives of the distances of one lane block along unit directions n. */
struct Jacobian {
  alignas(64) float row[6][LANES];

  inline void
  set(const float* const p[3], const float* const n[3])
  {
    for (std::size_t l = 0; l < LANES; ++l) {
      row[0][l] = p[1][l] * n[2][l] - p[2][l] * n[1][l];
      row[1][l] = p[2][l] * n[0][l] - p[0][l] * n[2][l];
      row[2][l] = p[0][l] * n[1][l] - p[1][l] * n[0][l];
      row[3][l] = n[0][l];
      row[4][l] = n[1][l];
      row[5][l] = n[2][l];
    }
  }
};

/** Products of each lane block, added up in float lanes and folded into doubles per
 * chunk. */
BUNDLE_ICP_INLINE void
sumChunk(const Matches& m, std::size_t begin, std::size_t end, float cutoff, float inlier,
         Sums& sums)
{
  alignas(64) float acc[SUMS][LANES] = {};
  const float inverse_cutoff = 1 / cutoff;
  for (std::size_t block = begin; block < end; block += LANES) {
    Jacobian J, S;
    alignas(64) float w[LANES], wr[LANES];
    const float* const p[3] = {&m.px[block], &m.py[block], &m.pz[block]};
    const float* const n[3] = {&m.nx[block], &m.ny[block], &m.nz[block]};
    const float* const s[3] = {&m.sx[block], &m.sy[block], &m.sz[block]};
    const float *r = &m.residual[block], *inv = &m.inverse_sigma[block];
    J.set(p, n);
    S.set(p, s);
    for (std::size_t l = 0; l < LANES; ++l) {
      const float e = std::abs(r[l] * inv[l]), t = e * inverse_cutoff;
      const float inside = t < 1 ? 1 - t * t : 0, hit = inv[l] > 0 ? 1.0f : 0.0f;
      const float robust = inside * inside * hit, in = e < inlier ? hit : 0.0f;
      w[l] = robust * inv[l] * inv[l];
      wr[l] = w[l] * r[l];
      acc[48][l] += w[l];
      acc[49][l] += robust * r[l] * r[l];
      acc[50][l] += robust;
      acc[51][l] += hit;
      acc[52][l] += in;
      acc[53][l] += in * r[l] * r[l];
    }
    std::size_t k = 0;
    for (int a = 0; a < 6; ++a)
      for (int b = a; b < 6; ++b, ++k)
        for (std::size_t l = 0; l < LANES; ++l) {
          acc[k][l] += w[l] * J.row[a][l] * J.row[b][l];
          acc[k + 27][l] += w[l] * (J.row[a][l] * S.row[b][l] + S.row[a][l] * J.row[b][l]);
        }
    for (int a = 0; a < 6; ++a, ++k)
      for (std::size_t l = 0; l < LANES; ++l)
        acc[k][l] += wr[l] * J.row[a][l];
  }
  for (std::size_t k = 0; k < SUMS; ++k)
    for (std::size_t l = 0; l < LANES; ++l)
      sums.value[k] += double(acc[k][l]);
}

/** -H^-1 g along the directions that H holds. */
Vector6d
minimum(const Matrix6d& H, const Vector6d& g)
{
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(H);
  const double smallest = 1e-9 * solver.eigenvalues()[5];
  Vector6d step = Vector6d::Zero();
  for (int k = 0; k < 6; ++k)
    if (solver.eigenvalues()[k] > smallest) {
      const Vector6d direction = solver.eigenvectors().col(k);
      step -= direction * (direction.dot(g) / solver.eigenvalues()[k]);
    }
  return step;
}

} // namespace

DenseSystem
accumulate(const Matches& matches, double scale, int num_threads)
{
  const std::size_t chunks = (matches.size() + CHUNK - 1) / CHUNK;
  std::vector<Sums> partial(chunks);
  const float cutoff = float(TUKEY_CUTOFF * scale), inlier = float(3 * scale);
#pragma omp parallel for num_threads(resolveThreads(num_threads)) schedule(static)
  for (std::size_t c = 0; c < chunks; ++c)
    simd::call<sumChunk>(matches, c * CHUNK, std::min(matches.size(), (c + 1) * CHUNK), cutoff,
                         inlier, partial[c]);
  Sums total;
  for (const Sums& sums : partial)
    for (std::size_t k = 0; k < SUMS; ++k)
      total.value[k] += sums.value[k];
  DenseSystem system;
  std::size_t k = 0;
  for (int a = 0; a < 6; ++a)
    for (int b = a; b < 6; ++b, ++k) {
      system.H(a, b) = system.H(b, a) = total.value[k];
      system.structure(a, b) = system.structure(b, a) = 0.5 * total.value[k + 27];
    }
  for (int a = 0; a < 6; ++a, ++k)
    system.g[a] = total.value[k];
  system.weight = total.value[48];
  system.squared_error = total.value[49];
  system.weight_metric = total.value[50];
  system.matched = std::size_t(total.value[51]);
  system.inliers = std::size_t(total.value[52]);
  system.squared_inliers = total.value[53];
  return system;
}

VisualSystem
accumulateVisual(const VisualCorrespondences& visual, const Pose& pose,
                 const Eigen::Vector3d& center, double scale)
{
  constexpr double LIMIT = OUTLIER_SIGMAS * OUTLIER_SIGMAS;
  VisualSystem system;
  for (std::size_t i = 0; i < visual.source.size(); ++i) {
    const Eigen::Vector3d p = pose * visual.source[i];
    const Eigen::Vector3d residual = p - visual.target[i];
    const double weight = visual.weights[i] / (scale * scale);
    const double error = weight * residual.squaredNorm();
    system.cost += std::min(LIMIT, error);
    if (error >= LIMIT)
      continue;
    ++system.inliers;
    system.squared_inliers += residual.squaredNorm();
    const double inside = 1 - error / LIMIT;
    Eigen::Matrix<double, 3, 6> J;
    J.leftCols<3>() = -crossMatrix(p - center);
    J.rightCols<3>().setIdentity();
    const double robust = weight * inside * inside;
    system.H += robust * J.transpose() * J;
    system.g += robust * J.transpose() * residual;
  }
  return system;
}

bool
agreesLess(const VisualSystem& refined, const VisualSystem& own)
{
  return refined.cost > 1.3 * own.cost + 20 || double(refined.inliers) < 0.7 * double(own.inliers);
}

Step
solve(const DenseSystem& dense, double variance_factor, const VisualSystem& visual,
      const Observability& observability)
{
  // In units of length, so that eigenvalues of rotations and translations compare.
  Vector6d unit = Vector6d::Ones();
  unit.head<3>().setConstant(1 / observability.length);
  const auto S = unit.asDiagonal();
  const Matrix6d H = S * (dense.H / variance_factor) * S;
  const double weight = dense.weight / variance_factor;
  const Matrix6d structure = S * (dense.structure / variance_factor) * S;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(observability.misaligned ? H : structure);
  Step step;
  Matrix6d held = Matrix6d::Zero();
  for (int k = 0; k < 6; ++k) {
    const Vector6d direction = eigen.eigenvectors().col(k);
    const double information = eigen.eigenvalues()[k];
    const double limit = observability.max_deviation;
    if (information > observability.min_share * weight && information * limit * limit > 1)
      held += direction * direction.transpose();
    else
      step.degenerate.push_back((S * direction).normalized());
  }
  const Matrix6d dense_H = held * (observability.misaligned ? H : structure) * held;
  const Vector6d dense_g = held * (S * (dense.g / variance_factor));
  step.dense_delta = S * minimum(dense_H, dense_g);
  step.delta = S * minimum(dense_H + S * visual.H * S, dense_g + S * visual.g);
  const Vector6d back = unit.cwiseInverse();
  step.information = back.asDiagonal() * dense_H * back.asDiagonal();
  return step;
}

Matrix6d
robustInformation(const Matrix6d& information, double variance_factor,
                  const std::vector<Vector6d>& gradients, double model_share)
{
  const auto count = double(gradients.size());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information);
  const Eigen::Index held = (eigen.eigenvalues().array() > 1e-9 * eigen.eigenvalues()[5]).count();
  if (count < MIN_TILES || held == 0)
    return information;
  const Eigen::MatrixXd basis = eigen.eigenvectors().rightCols(held);
  const Eigen::MatrixXd H = variance_factor * basis.transpose() * information * basis;
  // No data are as exact as those that agree by chance.
  Eigen::MatrixXd M = (LEAST_VARIANCE + model_share * variance_factor) * H;
  // Six gradients' worth went into the pose.
  for (const Vector6d& gradient : gradients) {
    const Eigen::VectorXd g = basis.transpose() * gradient;
    M += (1 - model_share) * count / (count - 6) * g * g.transpose();
  }
  const Matrix6d result = basis * (H * M.ldlt().solve(H)) * basis.transpose();
  return 0.5 * (result + result.transpose());
}

} // namespace bundle_icp
