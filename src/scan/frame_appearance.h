// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/graph/image_graph.h>
#include <bundle_icp/model/sparse_model.h>
#include <bundle_icp/volume/tsdf_volume.h>

#include <vector>

namespace bundle_icp {

/** Appearance of the frames, from the image graph and the model's tracks: gains that give the same
 *  points the same colour, and weights by sharpness relative to frames of the same points. One
 *  entry for each frame of the graph. */
std::vector<ColorCorrection>
colorCorrections(const ImageGraph& graph, const SparseModel& model);

} // namespace bundle_icp
