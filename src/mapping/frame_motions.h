// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/model/sparse_model.h>

namespace bundle_icp {

/** Pose of `frame` if the camera continues its motion from frame `before` to frame `last`; the pose
 *  of `last` where stamps do not tell how far. */
Pose
extrapolatedPose(const ImageGraph& graph, const SparseModel& model, std::size_t before,
                 std::size_t last, std::size_t frame);

/** Sets SparseModel::motion() of the registered frames of a component from the poses of their
 *  neighbours in time: the slope of a polynomial through the nearest one or two on either side.
 *  Frames without neighbours within 0.8 s get no motion. */
void
estimateMotions(const ImageGraph& graph, int component, SparseModel& model);

} // namespace bundle_icp
