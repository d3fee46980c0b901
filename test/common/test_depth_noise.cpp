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
