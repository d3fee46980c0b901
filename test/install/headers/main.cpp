// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Every public header compiles, and what it declares links, with what the target
// carries.
#include "headers.h" // written by check_install.cmake: all public headers

int
main()
{
  bundle_icp::SyntheticScanOptions options;
  options.width = 64;
  options.height = 48;
  options.focal_length = 50;
  const bundle_icp::SyntheticScan scan(options);
  const auto volume = std::make_shared<bundle_icp::TSDFVolume>();
  volume->integrate(scan.read(0), scan.camera(), scan.worldFromCamera(0));
  bundle_icp::TSDFMarchingCubes<pcl::PointXYZRGBNormal> cubes;
  cubes.setVolume(volume);
  pcl::PolygonMesh mesh;
  cubes.reconstruct(mesh);
  return mesh.polygons.empty() ? 1 : 0;
}
