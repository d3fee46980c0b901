// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/registration/impl/point_alignment.h>

#include <vector>

namespace bundle_icp {

/** Source points of one level of detail, as arrays of one coordinate each. */
struct SourcePoints {
  std::vector<float> x, y, z;
  std::vector<float> nx, ny, nz; ///< empty without normals
  std::vector<int> index;        ///< in the source cloud
  int stride = 1;                ///< every so many pixels of it, both ways
  double patch = 1;              ///< how many of these points share the noise of one measurement

  std::size_t
  size() const
  {
    return index.size();
  }
};

/** The points of a problem's source in levels of detail, coarse to fine: from every fourth pixel of
 *  the last level's grid to that itself, or of a list as many. Points that are not finite are left
 *  out.
 *  \param projective whether matches are found by projection: the noise of neighbouring pixels is
 *  then correlated */
std::vector<SourcePoints>
selectLevels(const AlignmentProblem& problem, bool projective);

} // namespace bundle_icp
