// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/model/sparse_model.h>

#include <optional>

namespace bundle_icp {

/** Frames that were all taken from one place in one direction. */
struct StillCamera {
  std::size_t frames = 0;
  double distance = 0; ///< largest from the middle one [m]
  double angle = 0;    ///< likewise [rad]
};

/** Set when the camera stands still: nearly all frames of a component are so close together that
 *  they show the scene from one side, and nothing of the camera's calibration. */
std::optional<StillCamera>
findStillCamera(const ImageGraph& graph, const SparseModel& model, int component);

} // namespace bundle_icp
