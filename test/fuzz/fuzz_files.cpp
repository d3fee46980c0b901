// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Readers of single files. The first byte of the input chooses one, the rest is the file.
#include "reader.h"

#include <bundle_icp/io/calibration_io.h>
#include <bundle_icp/io/mesh_io.h>
#include <bundle_icp/io/trajectory.h>

extern "C" int
LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  if (size == 0)
    return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::string file = fuzz::folder() + "/file";
  fuzz::write(file, bytes);
  bundle_icp::CameraIntrinsics camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 525;
  camera.cx = 319.5;
  camera.cy = 239.5;
  fuzz::read([&] {
    switch (data[0] % 7) {
    case 0:
      bundle_icp::readTrajectory(file);
      break;
    case 1:
      bundle_icp::readTimestamps(file);
      break;
    case 2:
      bundle_icp::readMesh(file);
      break;
    case 3:
      bundle_icp::readCalibration(file, camera);
      break;
    case 4:
      bundle_icp::readDepthNoise(file);
      break;
    case 5:
      bundle_icp::readDepthToColor(file);
      break;
    case 6:
      bundle_icp::parseIntrinsics(bytes);
      break;
    }
  });
  return 0;
}
