// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/find_features.h"

#include "graph/feature_checks.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

namespace bundle_icp {

Features
findFeatures(const RGBDFrame& frame, const CameraIntrinsics& camera, const std::string& name,
             const ReconstructionOptions& options)
{
  if (!options.find_features)
    return extractFeatures(frame, camera, options.features);
  Features features;
  try {
    features = options.find_features(frame, camera, options.features);
  }
  catch (const std::exception& error) {
    throw IOException(name + ": find_features failed: " + messageOf(error));
  }
  if (const std::string fault = faultOf(features, camera); !fault.empty())
    throw IOException(name + ": find_features gave wrong features: " + fault);
  return features;
}

} // namespace bundle_icp
