// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Registers a new frame against the virtual depth of three registered frames. Frames,
// poses and correspondences come from a simulated scan here.
#include <bundle_icp/registration/bundle_icp.h>
#include <bundle_icp/simulation/synthetic_scan.h>
#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <iostream>

int
main()
{
  const bundle_icp::SyntheticScan scan;
  const bundle_icp::CameraIntrinsics camera = scan.camera();

  // The registered frames, prepared once for every later use.
  std::vector<bundle_icp::DepthView> views;
  for (const std::size_t i : {0, 1, 2})
    views.push_back(bundle_icp::makeDepthView(scan.read(i).depth, camera));
  std::vector<bundle_icp::RegisteredView> registered;
  for (std::size_t i = 0; i < views.size(); ++i)
    registered.push_back({&views[i], scan.worldFromCamera(i)});

  // The new frame, and a guess of its pose: the pose of the last frame.
  using Point = pcl::PointXYZRGBNormal;
  const bundle_icp::Pose guess = scan.worldFromCamera(2);
  const auto render = [&](const bundle_icp::Pose& world_from_virtual) {
    return bundle_icp::toPointCloud(
        bundle_icp::renderVirtualDepth(registered, camera, world_from_virtual));
  };
  bundle_icp::BundleICP<Point, Point> reg;
  reg.setCameraIntrinsics(camera);
  reg.setInputSource(
      bundle_icp::toPointCloud(bundle_icp::makeDepthView(scan.read(4).depth, camera)));
  reg.setInputTarget(render(guess));
  reg.setVirtualDepthPose(guess);
  reg.setVirtualDepthRenderer(render);
  pcl::PointCloud<Point> aligned;
  reg.align(aligned, guess.matrix().cast<float>());
  if (!reg.hasConverged()) {
    std::cerr << "The frame could not be registered\n";
    return 1;
  }

  const bundle_icp::Pose pose(reg.getFinalTransformation().cast<double>());
  const bundle_icp::BundleICPResult& result = reg.getResult();
  std::cout << "world_from_camera\n"
            << pose.matrix() << "\n"
            << "overlap " << result.overlap << ", rmse " << result.rmse << " m, "
            << result.iterations << " iterations\n"
            << "error " << (pose.translation() - scan.worldFromCamera(4).translation()).norm()
            << " m\n";
  return 0;
}
