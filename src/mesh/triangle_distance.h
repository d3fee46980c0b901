// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <Eigen/Core>

namespace bundle_icp {

/** Distance of a point to a triangle, squared. */
double
squaredDistance(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                const Eigen::Vector3d& c);

} // namespace bundle_icp
