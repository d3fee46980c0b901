// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// BundleICP with your own point type: define PCL_NO_PRECOMPILE before any header of PCL and
// register the type with PCL. Without a camera BundleICP is an ICP with a kd-tree.
#define PCL_NO_PRECOMPILE
#include <bundle_icp/registration/bundle_icp.h>

#include <iostream>
#include <random>

struct EIGEN_ALIGN16 StampedPoint {
  PCL_ADD_POINT4D
  double stamp;
  PCL_MAKE_ALIGNED_OPERATOR_NEW
};
POINT_CLOUD_REGISTER_POINT_STRUCT(StampedPoint,
                                  (float, x, x)(float, y, y)(float, z, z)(double, stamp, stamp))

int
main()
{
  // The corner of a room, and the same corner seen from 3 cm to the side.
  pcl::PointCloud<StampedPoint>::Ptr target(new pcl::PointCloud<StampedPoint>);
  pcl::PointCloud<StampedPoint>::Ptr source(new pcl::PointCloud<StampedPoint>);
  std::mt19937 random(0);
  std::uniform_real_distribution<float> metres(0, 2);
  for (int i = 0; i < 5000; ++i) {
    StampedPoint point;
    point.getVector4fMap() << metres(random), metres(random), metres(random), 1;
    point.data[i % 3] = 0;
    point.stamp = i;
    target->push_back(point);
    point.x -= 0.03f;
    source->push_back(point);
  }

  bundle_icp::BundleICP<StampedPoint, StampedPoint> reg;
  reg.setInputSource(source);
  reg.setInputTarget(target);
  pcl::PointCloud<StampedPoint> aligned;
  reg.align(aligned);
  std::cout << "target_from_source\n" << reg.getFinalTransformation() << "\n";
  return reg.hasConverged() ? 0 : 1;
}
