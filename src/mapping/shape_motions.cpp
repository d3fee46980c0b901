// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/part_shape.h"

#include "registration/basin_search.h"

#include <bundle_icp/common/rigid_alignment.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

namespace bundle_icp {
namespace {

/** Cells of the grid, in spacings of the cloud. */
constexpr double CELL = 2;
/** Largest number of cells: a larger cloud gets larger ones. */
constexpr double MAX_CELLS = 2e6;
/** Points of the second cloud that are looked up. */
constexpr std::size_t MAX_POINTS = 400;
/** Most similar keypoints of the first part that a keypoint of the second is paired with. */
constexpr std::size_t NUM_SIMILAR = 3;
constexpr int SAMPLES = 100000;
/** Sides of a triangle of keypoints: the shortest in spacings, and how far they may differ. */
constexpr double SHORTEST_SIDE = 6, SIDE_ERROR = 2;
constexpr double NORMAL_COSINE = 0.85; // 30 degrees
/** Volume that three normals span. */
constexpr double LEAST_VOLUME = 0.5;
constexpr double PLANE_ANGLE_ERROR = 0.07;

/** Where the first cloud has points, by direction of their normals. */
class OccupiedCells {
public:
  explicit OccupiedCells(const PartShape& shape)
  {
    Eigen::Vector3f low = Eigen::Vector3f::Constant(1e30F), high = -low;
    for (const pcl::PointNormal& point : shape.cloud) {
      low = low.cwiseMin(point.getVector3fMap());
      high = high.cwiseMax(point.getVector3fMap());
    }
    double cell = CELL * shape.spacing;
    while (((high - low).array() / float(cell) + 3).cast<double>().prod() > MAX_CELLS)
      cell *= 1.5;
    inverse_ = 1 / float(cell);
    origin_ = low.array() - float(cell);
    size_ = ((high - origin_) * inverse_).cast<int>().array() + 2;
    sides_.assign(std::size_t(size_.prod()), 0);
    for (const pcl::PointNormal& point : shape.cloud)
      fill(cellOf(point.getVector3fMap()), sidesOf(point.getNormalVector3fMap(), 0.5F));
  }

  bool
  has(const Eigen::Vector3f& point, const Eigen::Vector3f& normal) const
  {
    const Eigen::Vector3i cell = cellOf(point);
    if ((cell.array() < 0).any() || (cell.array() >= size_.array()).any())
      return false;
    return (sides_[place(cell)] & sidesOf(normal, 0.577F)) != 0;
  }

private:
  /** Half-axes that a normal points along, as bits. */
  static unsigned char
  sidesOf(const Eigen::Vector3f& normal, float least)
  {
    unsigned sides = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      sides |= unsigned(normal[axis] > least) << (2 * axis);
      sides |= unsigned(normal[axis] < -least) << (2 * axis + 1);
    }
    return static_cast<unsigned char>(sides);
  }

  Eigen::Vector3i
  cellOf(const Eigen::Vector3f& point) const
  {
    return ((point - origin_) * inverse_).array().floor().cast<int>();
  }

  std::size_t
  place(const Eigen::Vector3i& cell) const
  {
    return (std::size_t(cell.z()) * std::size_t(size_.y()) + std::size_t(cell.y())) *
               std::size_t(size_.x()) +
           std::size_t(cell.x());
  }

  void
  fill(const Eigen::Vector3i& cell, unsigned char sides)
  {
    const Eigen::Vector3i low = (cell.array() - 1).max(0);
    const Eigen::Vector3i high = (cell.array() + 1).min(size_.array() - 1);
    for (int z = low.z(); z <= high.z(); ++z)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int x = low.x(); x <= high.x(); ++x)
          sides_[place({x, y, z})] |= sides;
  }

  Eigen::Vector3f origin_;
  Eigen::Vector3i size_;
  float inverse_ = 1;
  std::vector<unsigned char> sides_;
};

/** A motion and the number of points of the second cloud that lie on the first. */
struct ScoredMotion {
  Pose first_from_second;
  std::size_t score;
};

struct KeypointPair {
  std::size_t first, second;
};

using Descriptor = Eigen::Map<const Eigen::Matrix<float, 33, 1>>;

/** For each keypoint of the second part the most similar ones of the first. */
std::vector<KeypointPair>
similarKeypoints(const PartShape& first, const PartShape& second)
{
  std::vector<KeypointPair> pairs;
  std::vector<std::pair<float, std::size_t>> distances(first.keypoints.size());
  const std::size_t count = std::min(NUM_SIMILAR, distances.size());
  for (std::size_t j = 0; j < second.keypoints.size(); ++j) {
    const Descriptor wanted(second.keypoints[j].descriptor.data());
    for (std::size_t i = 0; i < distances.size(); ++i)
      distances[i] = {(Descriptor(first.keypoints[i].descriptor.data()) - wanted).squaredNorm(), i};
    std::partial_sort(distances.begin(), distances.begin() + std::ptrdiff_t(count),
                      distances.end());
    for (std::size_t k = 0; k < count; ++k)
      pairs.push_back({distances[k].second, j});
  }
  return pairs;
}

/** The motion of three pairs of keypoints, where they form the same triangle. */
std::optional<Pose>
motionOf(const PartShape& first, const PartShape& second, const KeypointPair (&pairs)[3])
{
  std::vector<PointPair> points;
  for (const KeypointPair& pair : pairs)
    points.push_back({second.keypoints[pair.second].point.cast<double>(),
                      first.keypoints[pair.first].point.cast<double>()});
  for (std::size_t k = 0; k < 3; ++k) {
    const PointPair &a = points[k], &b = points[(k + 1) % 3];
    const double side = (a.source - b.source).norm();
    if (side < SHORTEST_SIDE * second.spacing ||
        std::abs(side - (a.target - b.target).norm()) > SIDE_ERROR * second.spacing)
      return std::nullopt;
  }
  const std::optional<Pose> motion = rigidAlignment(points);
  if (!motion)
    return std::nullopt;
  const Eigen::Matrix3f turn = motion->linear().cast<float>();
  for (const KeypointPair& pair : pairs)
    if ((turn * second.keypoints[pair.second].normal).dot(first.keypoints[pair.first].normal) <
        NORMAL_COSINE)
      return std::nullopt;
  return motion;
}

std::vector<Pose>
motionsByKeypoints(const PartShape& first, const PartShape& second)
{
  std::vector<Pose> motions;
  const std::vector<KeypointPair> pairs = similarKeypoints(first, second);
  if (pairs.size() < 3)
    return motions;
  std::mt19937 random(1);
  for (int k = 0; k < SAMPLES; ++k) {
    KeypointPair sample[3];
    for (KeypointPair& pair : sample)
      pair = pairs[random() % pairs.size()];
    if (const auto motion = motionOf(first, second, sample))
      motions.push_back(*motion);
  }
  return motions;
}

/** Three planes that meet in a point, in each order. */
std::vector<std::array<std::size_t, 3>>
cornersOf(const std::vector<PartShape::Plane>& planes, bool all_orders)
{
  std::vector<std::array<std::size_t, 3>> corners;
  for (std::size_t a = 0; a < planes.size(); ++a)
    for (std::size_t b = 0; b < planes.size(); ++b)
      for (std::size_t c = 0; c < planes.size(); ++c) {
        if (a == b || b == c || a == c || (!all_orders && (a > b || b > c)))
          continue;
        const double volume = planes[a].normal.cross(planes[b].normal).dot(planes[c].normal);
        if (std::abs(volume) > LEAST_VOLUME)
          corners.push_back({a, b, c});
      }
  return corners;
}

/** The motion that brings three planes onto three others at the same angles. */
std::optional<Pose>
motionOf(const std::array<PartShape::Plane, 3>& first,
         const std::array<PartShape::Plane, 3>& second)
{
  Eigen::Matrix3d to, from;
  for (int k = 0; k < 3; ++k) {
    to.col(k) = first[std::size_t(k)].normal;
    from.col(k) = second[std::size_t(k)].normal;
  }
  if (((to.transpose() * to) - (from.transpose() * from)).cwiseAbs().maxCoeff() >
          PLANE_ANGLE_ERROR ||
      to.determinant() * from.determinant() < 0)
    return std::nullopt;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(to * from.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Pose motion = Pose::Identity();
  motion.linear() = svd.matrixU() * svd.matrixV().transpose();
  if (motion.linear().determinant() < 0)
    return std::nullopt;
  // The corner of the second part comes to that of the first.
  Eigen::Vector3d to_offsets, from_offsets;
  for (int k = 0; k < 3; ++k) {
    to_offsets[k] = first[std::size_t(k)].offset;
    from_offsets[k] = second[std::size_t(k)].offset;
  }
  const Eigen::Vector3d to_corner = to.transpose().inverse() * to_offsets;
  const Eigen::Vector3d from_corner = from.transpose().inverse() * from_offsets;
  motion.translation() = to_corner - motion.linear() * from_corner;
  return motion;
}

std::vector<Pose>
motionsByPlanes(const PartShape& first, const PartShape& second)
{
  std::vector<Pose> motions;
  const auto of_first = cornersOf(first.planes, false), of_second = cornersOf(second.planes, true);
  for (const auto& [a, b, c] : of_first)
    for (const auto& [i, j, k] : of_second)
      if (const auto motion = motionOf({first.planes[a], first.planes[b], first.planes[c]},
                                       {second.planes[i], second.planes[j], second.planes[k]}))
        motions.push_back(*motion);
  return motions;
}

} // namespace

std::vector<Pose>
motionsByShape(const PartShape& first, const PartShape& second, std::size_t max_motions)
{
  if (first.cloud.empty() || second.cloud.empty())
    return {};
  std::vector<Pose> motions = motionsByPlanes(first, second);
  const std::vector<Pose> by_keypoints = motionsByKeypoints(first, second);
  motions.insert(motions.end(), by_keypoints.begin(), by_keypoints.end());
  const OccupiedCells cells(first);
  const std::size_t step = (second.cloud.size() + MAX_POINTS - 1) / MAX_POINTS;
  std::vector<ScoredMotion> scored;
  for (const Pose& motion : motions) {
    const Eigen::Isometry3f moved = motion.cast<float>();
    std::size_t score = 0;
    for (std::size_t k = 0; k < second.cloud.size(); k += step)
      score += cells.has(moved * second.cloud[k].getVector3fMap(),
                         moved.linear() * second.cloud[k].getNormalVector3fMap());
    scored.push_back({motion, score});
  }
  std::stable_sort(scored.begin(), scored.end(),
                   [](const ScoredMotion& a, const ScoredMotion& b) { return a.score > b.score; });
  std::vector<Pose> best;
  for (const ScoredMotion& motion : scored) {
    if (best.size() == max_motions)
      break;
    if (std::none_of(best.begin(), best.end(),
                     [&](const Pose& other) { return areAlike(other, motion.first_from_second); }))
      best.push_back(motion.first_from_second);
  }
  return best;
}

} // namespace bundle_icp
