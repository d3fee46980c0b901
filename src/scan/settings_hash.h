// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/graph/features.h>
#include <bundle_icp/graph/image_graph.h>
#include <bundle_icp/mapping/incremental_mapper.h>

#include <cstdint>
#include <string>

namespace bundle_icp {

/** Hash of bytes and of the versions of all that makes features, matches and poses of them. */
std::uint64_t
settingsHash(const std::string& bytes);

/** Of all that the features of an image depend on besides its pixels. */
std::uint64_t
settingsHash(const FeatureOptions& options, const CameraIntrinsics& camera);

/** Of all that the matches of two images depend on besides their features. */
std::uint64_t
settingsHash(const MatchingOptions& options);

/** Of all that poses depend on besides the frames.
 *  \param depth_reduction see ReconstructionOptions::depth_reduction
 *  \param view_options of the prepared depth */
std::uint64_t
settingsHash(const ImageGraphOptions& graph, const MapperOptions& mapper, int depth_reduction,
             const VirtualDepthOptions& view_options);

} // namespace bundle_icp
