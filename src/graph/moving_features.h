// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/graph/feature_matching.h>

#include <vector>

namespace bundle_icp {

/** Where a thing moves before the camera, its motion and that of the camera stand in many pairs. Of
 *  two motions the one whose matches cover more of the image becomes that of the pair, not the one
 *  with more texture. Pairs most of whose matches lie on what moves are removed: those that share
 *  nothing else would place frames by it.
 *  In fewer pairs a second motion is that of textures that repeat themselves, and is dropped.
 *  \param features of the frames that the pairs index */
void
separateMotions(const std::vector<const Features*>& features, const CameraIntrinsics& camera,
                std::vector<FramePair>& pairs);

} // namespace bundle_icp
