// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/reconstruction.h>

#include <string>

namespace bundle_icp {

/** Features of a frame, by the caller's own function where there is one.
 *  \param name of the frame, for messages
 *  \throws pcl::IOException naming the frame when that function fails or gives nonsense. */
Features
findFeatures(const RGBDFrame& frame, const CameraIntrinsics& camera, const std::string& name,
             const ReconstructionOptions& options);

} // namespace bundle_icp
