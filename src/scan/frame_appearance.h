// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/graph/image_graph.h>
#include <bundle_icp/model/sparse_model.h>
#include <bundle_icp/volume/tsdf_volume.h>

#include <vector>

namespace bundle_icp {

/** What the image graph and the tracks of the model say of the images' colours: gains that make
 *  the same points look the same, and weights by sharpness relative to the images that see the
 *  same. One for each image of the graph. */
std::vector<ColorCorrection>
colorCorrections(const ImageGraph& graph, const SparseModel& model);

} // namespace bundle_icp
