// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/mesh/mesh_decimation.h>

namespace bundle_icp {

/** Collapses edges until `options` are met or no edge is left that may be. \return the squared
 *  distance of each vertex before to the mesh after, at most [m^2]. */
std::vector<double>
collapseEdges(SurfaceMesh& mesh, const MeshDecimationOptions& options);

} // namespace bundle_icp
