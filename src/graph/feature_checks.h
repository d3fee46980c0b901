// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/graph/features.h>

#include <string>

namespace bundle_icp {

/** Numbers of a row of Features::descriptors, and the largest one. */
constexpr int DESCRIPTOR_SIZE = 128;
constexpr int LARGEST_IN_DESCRIPTOR = 127;

/** Throws pcl::BadArgumentException for invalid options, or images of wrong type or size.
 *  \param function that has these arguments, for the message */
void
checkFeatureArguments(const char* function, const RGBDFrame& frame, const CameraIntrinsics& camera,
                      const FeatureOptions& options);

/** What of features is not as Features and FeatureFinder ask for; empty when all is well. */
std::string
faultOf(const Features& features, const CameraIntrinsics& camera);

} // namespace bundle_icp
