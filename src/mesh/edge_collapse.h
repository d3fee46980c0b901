// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/mesh/mesh_decimation.h>

namespace bundle_icp {

/** Distance of a point to a triangle, squared. */
double
squaredDistance(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                const Eigen::Vector3d& c);

/** Collapses edges until `options` are met or no edge is left that may be collapsed. \return for
 *  each vertex before, an upper bound of the squared distance to the mesh after [m^2]. */
std::vector<double>
collapseEdges(SurfaceMesh& mesh, const MeshDecimationOptions& options);

} // namespace bundle_icp
