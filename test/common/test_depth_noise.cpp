// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/depth_noise.h>

#include "messages.h"

#include <limits>

using namespace bundle_icp;

TEST(DepthNoise, IsSmallestAtTheOffsetAndGrowsFromThere)
{
  const DepthNoise noise;
  EXPECT_DOUBLE_EQ(noise.sigma(noise.offset), noise.constant);
  EXPECT_NEAR(noise.sigma(3.4), 0.0012 + 0.0019 * 9, 1e-12); // [m], by hand
  for (double z = noise.offset; z < 8; z += 0.1)
    EXPECT_LT(noise.sigma(z), noise.sigma(z + 0.1));
}

TEST(DepthNoise, KindsOfSensorsAreAsTheirSourcesSay)
{
  EXPECT_EQ(sensorName(*depthNoiseOf("kinect")), sensorName(DepthNoise()));
  EXPECT_NEAR(depthNoiseOf("lidar")->sigma(1), 0.0025, 1e-5);
  EXPECT_NEAR(depthNoiseOf("lidar")->sigma(9), 0.0155, 1e-5);
  for (const double z : {0.5, 1.5, 4.0})
    EXPECT_NEAR(depthNoiseOf("tof")->sigma(z), 1e-3 * (1.5 - 0.5 * z + 0.3 * z * z), 1e-5);
  EXPECT_NEAR(depthNoiseOf("d400")->quadratic, 0.08 / (425 * 0.05), 2e-4);
  EXPECT_FALSE(depthNoiseOf("Kinect"));
  EXPECT_EQ(sensorName({0.1, 0, 0}), "custom");
}

TEST(DepthNoise, RefusesWhatIsNoStandardDeviation)
{
  EXPECT_TRUE(DepthNoise().isValid());
  for (const double constant : {0.0, -0.001, std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::infinity()}) {
    DepthNoise noise;
    noise.constant = constant;
    std::string error;
    EXPECT_FALSE(noise.isValid(&error)) << constant;
    EXPECT_CONTAINS(error, "constant > 0 m");
  }
  DepthNoise noise;
  noise.quadratic = -1e-9;
  EXPECT_FALSE(noise.isValid());
}
