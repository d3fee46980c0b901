// SPDX-License-Identifier: BSD-3-Clause
#define PCL_NO_PRECOMPILE
#include <bundle_icp/registration/bundle_icp.h>

#include <gtest/gtest.h>

#include <random>

namespace {

/** A private point type without normals. */
struct EIGEN_ALIGN16 LabelledPoint {
  PCL_ADD_POINT4D
  std::uint32_t label;
  PCL_MAKE_ALIGNED_OPERATOR_NEW
};

} // namespace

POINT_CLOUD_REGISTER_POINT_STRUCT(LabelledPoint,
                                  (float, x, x)(float, y, y)(float, z, z)(std::uint32_t, label,
                                                                          label))

TEST(BundleICP, TakesAPrivatePointTypeAndCanBeSubclassed)
{
  struct Subclass : bundle_icp::BundleICP<LabelledPoint, LabelledPoint> {
    int
    iterations() const
    {
      return this->nr_iterations_;
    }
  };
  pcl::PointCloud<LabelledPoint>::Ptr target(new pcl::PointCloud<LabelledPoint>);
  pcl::PointCloud<LabelledPoint>::Ptr source(new pcl::PointCloud<LabelledPoint>);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    LabelledPoint p;
    p.getVector4fMap() << uniform(random), uniform(random), uniform(random), 1;
    p.data[i % 3] = 0;
    p.label = i;
    target->push_back(p);
    p.x -= 0.03f;
    source->push_back(p);
  }
  Subclass reg;
  reg.setInputSource(source);
  reg.setInputTarget(target);
  pcl::PointCloud<LabelledPoint> out;
  reg.align(out);
  ASSERT_TRUE(reg.hasConverged());
  EXPECT_GT(reg.iterations(), 0);
  EXPECT_NEAR(reg.getFinalTransformation()(0, 3), 0.03f, 1e-4f);
  EXPECT_EQ(out[42].label, 42u);
}
