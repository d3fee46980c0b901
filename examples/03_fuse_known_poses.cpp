// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Fuses the frames of a recording whose camera poses are known into a coloured mesh.
//
//   bundle_icp_example_fuse_known_poses SCAN MESH.ply
//
// Left out: estimating the poses (bundle_icp_reconstruct does that), options, progress.
#include <bundle_icp/io/mesh_io.h>
#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/volume/tsdf_marching_cubes.h>

#include <pcl/point_types.h>

#include <cmath>
#include <exception>
#include <iostream>

namespace {

// The true pose closest in time, null when no pose lies within 20 ms.
const bundle_icp::TimedPose*
findPose(const bundle_icp::Trajectory& trajectory, double timestamp)
{
  const bundle_icp::TimedPose* closest = nullptr;
  double smallest = 0.02;
  for (const bundle_icp::TimedPose& pose : trajectory) {
    const double difference = std::abs(pose.timestamp - timestamp);
    if (difference <= smallest) {
      smallest = difference;
      closest = &pose;
    }
  }
  return closest;
}

void
fuse(const std::string& scan, const std::string& mesh_file)
{
  const auto dataset = bundle_icp::openDataset(scan);
  const bundle_icp::Trajectory trajectory = dataset->groundTruth();

  const auto volume = std::make_shared<bundle_icp::TSDFVolume>();
  for (std::size_t i = 0; i < dataset->size(); ++i)
    if (const auto* pose = findPose(trajectory, dataset->timestamp(i)))
      volume->integrate(dataset->read(i), dataset->camera(), pose->world_from_camera);

  bundle_icp::TSDFMarchingCubes<pcl::PointXYZRGBNormal> cubes;
  cubes.setVolume(volume);
  pcl::PolygonMesh mesh;
  cubes.reconstruct(mesh);
  if (mesh.polygons.empty())
    throw std::runtime_error(scan + ": no surface; has the recording poses?");
  bundle_icp::writeMesh(mesh_file, mesh);
  std::cerr << mesh_file << ": " << mesh.polygons.size() << " triangles\n";
}

} // namespace

int
main(int argc, char** argv)
{
  if (argc != 3) {
    std::cerr << "Usage: " << argv[0] << " SCAN MESH.ply\n";
    return 2;
  }
  try {
    fuse(argv[1], argv[2]);
  }
  catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
