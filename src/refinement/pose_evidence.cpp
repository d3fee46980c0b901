// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/pose_evidence.h"

#include <Eigen/Dense>

#include <cmath>
#include <vector>

namespace bundle_icp {
namespace {

/** More matches of a pair do not make its motion better known: images have errors of their own. */
constexpr std::size_t MAX_MATCHES = 150;
/** Rounds of weighting of the fit, which starts from the motion of the verification. */
constexpr int ROUNDS = 3;
/** Scale of the Cauchy loss on the distance of matched points [sigma]. */
constexpr double LOSS_SCALE = 2;
/** Pixels whose weight is below this share of that of a plain one lie at edges. */
constexpr float MIN_WEIGHT = 0.3F;

/** A pair of matched points, each in its camera's frame. */
struct MatchedPoints {
  Eigen::Vector3d first, second;
  Eigen::Vector3d sigmas; ///< of their distance, along the axes of the first camera [m]
};

std::vector<MatchedPoints>
matchedPoints(const ImageGraph& graph, const SparseModel& model, const FramePair& pair)
{
  const Features &first = graph.features(pair.first), &second = graph.features(pair.second);
  const double focal = graph.camera().fx;
  const auto lateral = [focal](const Features& features, std::size_t j) {
    return features.pixel_sigmas[j] * features.depths[j] / focal;
  };
  std::vector<MatchedPoints> points;
  const std::size_t step = (pair.matches.size() + MAX_MATCHES - 1) / MAX_MATCHES;
  for (std::size_t k = 0; k < pair.matches.size(); k += step) {
    const auto a = std::size_t(pair.matches[k].first), b = std::size_t(pair.matches[k].second);
    if (!first.hasDepth(a) || !second.hasDepth(b))
      continue;
    const double across = std::hypot(lateral(first, a), lateral(second, b));
    points.push_back({measuredPointInCamera(graph, model, {pair.first, pair.matches[k].first}),
                      measuredPointInCamera(graph, model, {pair.second, pair.matches[k].second}),
                      {across, across, std::hypot(first.depth_sigmas[a], second.depth_sigmas[b])}});
  }
  return points;
}

/** The motion that the matches support. */
Pose
fitMotion(const std::vector<MatchedPoints>& points, Pose first_from_second)
{
  for (int round = 0; round < ROUNDS; ++round) {
    Matrix6d information = Matrix6d::Zero();
    Vector6d gradient = Vector6d::Zero();
    for (const MatchedPoints& p : points) {
      const Eigen::Vector3d moved = first_from_second * p.second;
      const Eigen::Vector3d residual = (moved - p.first).cwiseQuotient(p.sigmas);
      Eigen::Matrix<double, 3, 6> jacobian;
      jacobian << -crossMatrix(moved), Eigen::Matrix3d::Identity();
      jacobian = p.sigmas.cwiseInverse().asDiagonal() * jacobian;
      const double weight = 1 / (1 + residual.squaredNorm() / (3 * LOSS_SCALE * LOSS_SCALE));
      information += weight * jacobian.transpose() * jacobian;
      gradient += weight * jacobian.transpose() * residual;
    }
    first_from_second = increment(-information.ldlt().solve(gradient)) * first_from_second;
  }
  return first_from_second;
}

} // namespace

double
displacementByMatches(const ImageGraph& graph, const SparseModel& model, const FramePair& pair)
{
  const std::vector<MatchedPoints> points = matchedPoints(graph, model, pair);
  if (points.empty())
    return 0;
  const Pose supported = fitMotion(points, pair.first_from_second);
  const Pose present =
      model.worldFromCamera(pair.first).inverse() * model.worldFromCamera(pair.second);
  double sum = 0;
  for (const MatchedPoints& p : points)
    sum += (present * p.second - supported * p.second).cwiseQuotient(p.sigmas).squaredNorm();
  return std::sqrt(sum / (3 * double(points.size())));
}

DepthComparison::DepthComparison(const DepthView& view, const DepthView& other,
                                 const Pose& other_from_view)
: view_(view), other_(other), other_from_view_(other_from_view)
{
}

bool
DepthComparison::isPlain(const DepthView& view, int row, int column)
{
  const double z = view.depth.at<float>(row, column);
  const double sigma = view.camera.depth_noise.sigma(z);
  return z > 0 && view.weight.at<float>(row, column) * sigma * sigma > MIN_WEIGHT;
}

std::optional<DepthComparison::Place>
DepthComparison::place(int row, int column) const
{
  const double z = view_.depth.at<float>(row, column);
  if (!(z > 0))
    return std::nullopt;
  const Eigen::Vector3d point = other_from_view_ * view_.camera.unproject(column, row, z);
  const Eigen::Vector2d pixel = other_.camera.project(point);
  if (!(point.z() > 0) || !other_.camera.contains(pixel))
    return std::nullopt;
  return Place{point, int(std::lround(pixel.y())), int(std::lround(pixel.x())),
               view_.camera.depth_noise.sigma(z)};
}

std::optional<double>
DepthComparison::sigmasInFront(const Place& place) const
{
  const int v = place.row, u = place.column;
  if (!isPlain(other_, v, u))
    return std::nullopt;
  const double seen = other_.depth.at<float>(v, u);
  const cv::Vec3f& n = other_.normals.at<cv::Vec3f>(v, u);
  const Eigen::Vector3d normal(n[0], n[1], n[2]);
  if (!normal.allFinite())
    return std::nullopt;
  // Along the normal, so that a slope between the centres of pixels does not count.
  const double distance = normal.dot(place.point - other_.camera.unproject(u, v, seen));
  return distance / (std::hypot(place.sigma, other_.camera.depth_noise.sigma(seen)) *
                     std::max(0.3, std::abs(normal.z())));
}

DepthAgreement
compareDepth(const DepthView& view, const DepthView& other, const Pose& other_from_view,
             const DepthComparisonOptions& options)
{
  const DepthComparison comparison(view, other, other_from_view);
  DepthAgreement agreement;
  const int step = std::max(1, view.camera.width / options.pixels_along_width);
  for (int row = step / 2; row < view.camera.height; row += step)
    for (int column = step / 2; column < view.camera.width; column += step)
      if (auto place = comparison.place(row, column);
          place && DepthComparison::isPlain(view, row, column)) {
        place->sigma = std::hypot(place->sigma, options.misplaced);
        if (const auto sigmas = comparison.sigmasInFront(*place))
          (std::abs(*sigmas) < AGREEING_SIGMAS ? agreement.agree
           : *sigmas > 0                       ? agreement.in_front
                                               : agreement.behind) += 1;
      }
  return agreement;
}

} // namespace bundle_icp
