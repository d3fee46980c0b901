// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/source_points.h"

#include "common/parallel.h"

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Source points used by the last level at most: more do not add independent
 * measurements. */
constexpr double POINTS_OF_LAST_LEVEL = 80000;
/** No level has fewer, unless the source has. */
constexpr double MIN_POINTS_OF_LEVEL = 500;
/** Pixels of one independent measurement, at a focal length of 525 px. */
constexpr double CORRELATED_PIXELS = 81, CORRELATED_FOCAL = 525;
/** Indices that one thread at a time selects source points from. */
constexpr std::size_t SELECTED = 16384;

/** Whether a source point is finite, with its normal where it has one. */
bool
isUsable(const PointsView& source, std::size_t index)
{
  const auto sum = [](const float* v) { return std::abs(v[0]) + std::abs(v[1]) + std::abs(v[2]); };
  const std::size_t offset = index * source.stride;
  return sum(source.xyz + offset) < 1e9f && (!source.normals || sum(source.normals + offset) < 4);
}

/** Of indices begin to end those of usable points: every `stride`-th pixel both ways, or of
 * a list as many. */
std::vector<int>
everyOf(const std::vector<int>& indices, std::size_t begin, std::size_t end,
        const PointsView& source, int stride)
{
  const bool is_grid = source.height > 1;
  const auto squared = std::size_t(stride * stride);
  // Of a grid, divisions would take longer than everything else here.
  std::vector<std::uint8_t> takes_column(is_grid ? std::size_t(source.width) : 0);
  for (std::size_t column = 0; column < takes_column.size(); ++column)
    takes_column[column] = int(column) % stride == stride / 2;
  int first_of_row = -source.width;
  bool takes_row = false;
  std::vector<int> chosen;
  chosen.reserve((end - begin) / squared + takes_column.size() + 1);
  for (std::size_t k = begin; k < end; ++k) {
    const int i = indices[k];
    if (i < 0 || std::size_t(i) >= source.size)
      continue;
    if (is_grid && (i < first_of_row || i >= first_of_row + source.width)) {
      const int row = i / source.width;
      first_of_row = row * source.width;
      takes_row = row % stride == stride / 2;
    }
    if ((is_grid ? takes_row && takes_column[i - first_of_row] : k % squared == 0) &&
        isUsable(source, std::size_t(i)))
      chosen.push_back(i);
  }
  return chosen;
}

/** All usable points of every `stride`-th pixel both ways, or of a list as many. */
SourcePoints
selectSource(const AlignmentProblem& problem, int stride)
{
  const PointsView& source = problem.source;
  const std::vector<int>& indices = *problem.source_indices;
  const int threads = resolveThreads(problem.num_threads);
  std::vector<std::vector<int>> chosen((indices.size() + SELECTED - 1) / SELECTED);
#pragma omp parallel for num_threads(threads) schedule(static)
  for (std::size_t c = 0; c < chosen.size(); ++c)
    chosen[c] = everyOf(indices, c * SELECTED, std::min(indices.size(), (c + 1) * SELECTED), source,
                        stride);
  SourcePoints points;
  for (const std::vector<int>& part : chosen)
    points.index.insert(points.index.end(), part.begin(), part.end());
  for (std::vector<float>* list : {&points.x, &points.y, &points.z})
    list->resize(points.size());
  if (source.normals)
    for (std::vector<float>* list : {&points.nx, &points.ny, &points.nz})
      list->resize(points.size());
#pragma omp parallel for num_threads(threads) schedule(static)
  for (std::size_t k = 0; k < points.size(); ++k) {
    const std::size_t offset = std::size_t(points.index[k]) * source.stride;
    const float* p = source.xyz + offset;
    points.x[k] = p[0];
    points.y[k] = p[1];
    points.z[k] = p[2];
    if (source.normals) {
      const float* n = source.normals + offset;
      points.nx[k] = n[0];
      points.ny[k] = n[1];
      points.nz[k] = n[2];
    }
  }
  return points;
}

} // namespace

std::vector<SourcePoints>
selectLevels(const AlignmentProblem& problem, bool projective)
{
  const double points = double(problem.source_indices->size());
  const int last = std::max(1, int(std::lround(std::sqrt(points / POINTS_OF_LAST_LEVEL))));
  const double focal = problem.camera ? problem.camera->fx : CORRELATED_FOCAL;
  const int sparsest = std::max(1, int(std::sqrt(points / MIN_POINTS_OF_LEVEL)));
  std::vector<SourcePoints> levels;
  for (const int wanted : {4 * last, 2 * last, last}) {
    const int stride = std::min(wanted, sparsest);
    SourcePoints level = selectSource(problem, stride);
    level.stride = stride;
    level.patch = std::max(1.0, CORRELATED_PIXELS * std::pow(focal / CORRELATED_FOCAL, 2) /
                                    (stride * stride));
    if (!projective)
      level.patch = 1;
    levels.push_back(std::move(level));
  }
  return levels;
}

} // namespace bundle_icp
