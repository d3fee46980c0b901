// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Registers two organized clouds of your own point type, through the interface
// that all registrations of PCL share.
// Must come before any header of PCL: the type below is not one of PCL's.
#define PCL_NO_PRECOMPILE
#include <bundle_icp/registration/bundle_icp.h>

#include <iostream>
#include <limits>

struct EIGEN_ALIGN16 LabelledPoint {
  PCL_ADD_POINT4D
  std::uint32_t label; // which wall it is on
  PCL_MAKE_ALIGNED_OPERATOR_NEW
};
POINT_CLOUD_REGISTER_POINT_STRUCT(LabelledPoint,
                                  (float, x, x)(float, y, y)(float, z, z)(std::uint32_t, label,
                                                                          label))

using Cloud = pcl::PointCloud<LabelledPoint>;

// The corner of a room, walls at x = 0.4 m, y = 0.3 m and z = 2 m, as a camera sees it:
// one point per pixel, in the camera's frame.
Cloud::Ptr
look(const bundle_icp::CameraIntrinsics& camera, const Eigen::Isometry3d& world_from_camera)
{
  const Eigen::Vector3d walls(0.4, 0.3, 2);
  Cloud::Ptr cloud(new Cloud(camera.width, camera.height));
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1);
      const Eigen::Vector3d direction = world_from_camera.linear() * ray;
      double depth = std::numeric_limits<double>::infinity();
      LabelledPoint& point = cloud->at(u, v);
      for (int axis = 0; axis < 3; ++axis) {
        const double distance =
            (walls[axis] - world_from_camera.translation()[axis]) / direction[axis];
        if (distance > 0 && distance < depth) {
          depth = distance;
          point.label = axis;
        }
      }
      point.getVector3fMap() = (depth * ray).cast<float>();
    }
  return cloud;
}

int
main()
{
  bundle_icp::CameraIntrinsics camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 260;
  camera.cx = 159.5;
  camera.cy = 119.5;

  // The second view: 6 cm and 4 degrees away from the first, whose frame is the world.
  Eigen::Isometry3d truth(Eigen::Translation3d(0.05, -0.02, 0.03));
  truth.rotate(Eigen::AngleAxisd(0.07, Eigen::Vector3d(1, 2, 0).normalized()));

  using BundleICP = bundle_icp::BundleICP<LabelledPoint, LabelledPoint>;
  BundleICP::Ptr bundle_icp(new BundleICP);
  bundle_icp->setCameraIntrinsics(camera); // points are associated by projection

  // From here on BundleICP is used like any other registration of PCL.
  pcl::Registration<LabelledPoint, LabelledPoint>::Ptr reg = bundle_icp;
  reg->setInputSource(look(camera, truth));
  reg->setInputTarget(look(camera, Eigen::Isometry3d::Identity()));
  Cloud aligned;
  reg->align(aligned);

  const Eigen::Isometry3d pose(reg->getFinalTransformation().cast<double>());
  const Eigen::Isometry3d error = truth.inverse() * pose;
  const double angle = Eigen::AngleAxisd(error.linear()).angle();
  std::cout << "error " << error.translation().norm() << " m, " << angle << " rad; rmse "
            << bundle_icp->getResult().rmse << " m\n";
  const bool is_right = reg->hasConverged() && error.translation().norm() < 1e-3 && angle < 1e-3;
  return is_right ? 0 : 1;
}
