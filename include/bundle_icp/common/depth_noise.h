// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <optional>
#include <string>

namespace bundle_icp {

/** Standard deviation of a measured depth, equation (1) of the paper: sigma(z) = constant +
 *  quadratic (z - offset)^2, along the optical axis. The defaults are those of the first Kinect,
 *  see depthNoiseOf(). The noise is part of the camera (CameraIntrinsics::depth_noise). Every
 *  weight and every threshold on depth in the library follows from it. */
struct BUNDLE_ICP_EXPORT DepthNoise {
  double constant = 0.0012;  ///< smallest standard deviation, at depth `offset` [m], > 0
  double quadratic = 0.0019; ///< growth with the square of the distance from `offset` [1/m], >= 0
  double offset = 0.4;       ///< depth of the smallest standard deviation [m]

  /** Standard deviation [m] at depth z [m]. */
  double
  sigma(double z) const
  {
    const double d = z - offset;
    return constant + quadratic * d * d;
  }

  bool
  isValid(std::string* error = nullptr) const;
};

/** Noise of a kind of sensor; unset for other names.
 *  - "kinect": structured light (Kinect, Xtion, PrimeSense). Nguyen, Izadi, Lovell, 3DIMPVT 2012.
 *  - "d400": active stereo (RealSense D435). Values of L. Kotsonis, as elevation_mapping has
 *    them for this form of the model; Intel's formula z^2 subpixel / (focal baseline) gives nearly
 *    the same growth: 0.08 px / (425 px 0.05 m) = 0.0038 /m at 848x480.
 *  - "tof": time of flight (Kinect v2, Azure Kinect). Fankhauser et al., ICAR 2015, frontal:
 *    1.5 - 0.5 z + 0.3 z^2 [mm].
 *  - "lidar": RealSense L515. Intel's data sheet: 2.5 mm at 1 m, 15.5 mm at 9 m. */
BUNDLE_ICP_EXPORT std::optional<DepthNoise>
depthNoiseOf(const std::string& sensor);

/** The name for which depthNoiseOf() gives this noise, or "custom". */
BUNDLE_ICP_EXPORT std::string
sensorName(const DepthNoise& noise);

} // namespace bundle_icp
