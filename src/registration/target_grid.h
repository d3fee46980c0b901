// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/registration/impl/point_alignment.h>

#include <string>

namespace bundle_icp {

/** The target in the form for projective association: with normals, and the camera of its grid. */
struct TargetGrid {
  PointsView points;
  CameraIntrinsics camera;
  Pose world_from_virtual = Pose::Identity();
  std::vector<float> storage; ///< six floats a point, when normals had to be computed
};

/** True when most finite points of the view carry a unit normal. */
bool
hasUnitNormals(const PointsView& view);

/** Prepares a target for projective association; unset, with the reason, when it is not
 *  organized, does not fit the camera, or does not project onto its own grid. */
std::optional<TargetGrid>
makeTargetGrid(const AlignmentProblem& problem, const PointsView& target,
               const Pose& world_from_virtual, std::string& reason);

} // namespace bundle_icp
