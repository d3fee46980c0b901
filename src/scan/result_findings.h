// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/camera_fixed.h"

#include <bundle_icp/reconstruction.h>

namespace bundle_icp {

/** What moves with the camera and is therefore left out. */
std::vector<Finding>
cameraFixedFindings(const CameraFixed& fixed);

/** What moves through the scene, which the surface leaves out. */
std::vector<Finding>
movingFindings(const std::vector<FrameReport>& frames);

/** How far and how large the scene is: what shows a wrong unit at a glance. */
std::vector<Finding>
sceneFindings(const ReconstructionResult& result);

/** Why there is no surface although one was asked for. */
Finding
emptySurface(const ReconstructionOptions& options, const ReconstructionResult& result);

} // namespace bundle_icp
