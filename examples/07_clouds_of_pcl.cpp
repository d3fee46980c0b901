// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Organized clouds in the frame of the camera, as PCL's grabbers give them, become frames.
#include <bundle_icp/common/organized_cloud.h>
#include <bundle_icp/io/memory_dataset.h>
#include <bundle_icp/reconstruction.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <iostream>

// Stands for the callback of a grabber.
pcl::PointCloud<pcl::PointXYZRGBA>
grab(const bundle_icp::SyntheticScan& scan, std::size_t i)
{
  const bundle_icp::RGBDFrame frame = scan.read(i);
  pcl::PointCloud<pcl::PointXYZRGBA> cloud(frame.depth.cols, frame.depth.rows);
  for (int v = 0; v < frame.depth.rows; ++v)
    for (int u = 0; u < frame.depth.cols; ++u) {
      const float z = frame.depth.at<float>(v, u);
      cloud(u, v).getVector3fMap() = scan.camera().unproject(u, v, z).cast<float>();
      std::copy_n(frame.color.at<cv::Vec3b>(v, u).val, 3, &cloud(u, v).b); // b, g, r
    }
  return cloud;
}

int
main()
{
  const bundle_icp::SyntheticScan scan;
  bundle_icp::MemoryDataset frames(bundle_icp::intrinsicsOf(grab(scan, 0)));
  for (std::size_t i = 0; i < 10; ++i)
    frames.add(bundle_icp::toFrame(grab(scan, i), frames.camera(), 0.1 * double(i)));
  std::cout << bundle_icp::reconstruct(frames).summary() << '\n';
}
