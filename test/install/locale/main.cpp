// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Files are the same in an application whose numbers have decimal commas and points between
// thousands: as a German desktop sets it, and where that locale is missing by a facet alone.
#include <bundle_icp/io/calibration_io.h>
#include <bundle_icp/io/trajectory.h>

#include <clocale>
#include <cmath>
#include <fstream>
#include <iostream>
#include <locale>
#include <sstream>
#include <string>

namespace {

class Commas : public std::numpunct<char> {
  char
  do_decimal_point() const override
  {
    return ',';
  }

  char
  do_thousands_sep() const override
  {
    return '.';
  }

  std::string
  do_grouping() const override
  {
    return "\3";
  }
};

std::string
readFile(const char* path)
{
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/** Writes and reads a trajectory and a calibration. \return both files. */
std::string
writeAndRead()
{
  bundle_icp::TimedPose pose;
  pose.timestamp = 1305031102.25;
  pose.world_from_camera.translation() << 1234.5, -0.25, 1e-3;
  bundle_icp::writeTrajectory("trajectory.txt", {pose});
  const bundle_icp::TimedPose read = bundle_icp::readTrajectory("trajectory.txt").at(0);
  if (read.timestamp != pose.timestamp ||
      !read.world_from_camera.isApprox(pose.world_from_camera, 1e-9))
    throw std::runtime_error("another pose was read than was written");

  bundle_icp::CameraIntrinsics camera = bundle_icp::parseIntrinsics("1525.5,525.25,319.5,239.5");
  camera.width = 640;
  camera.height = 480;
  bundle_icp::Calibration calibration;
  calibration[bundle_icp::CalibrationParameter::READOUT] = 0.0125;
  calibration.scaleDepth(1.0625);
  bundle_icp::writeCalibration("calibration.json", calibration, camera);
  const bundle_icp::Calibration again = bundle_icp::readCalibration("calibration.json", camera);
  if (camera.fx != 1525.5 || again.values != calibration.values ||
      again.depth_scale != calibration.depth_scale)
    throw std::runtime_error("another calibration was read than was written");
  return readFile("trajectory.txt") + readFile("calibration.json");
}

} // namespace

int
main()
{
  try {
    const std::string expected = writeAndRead();
    if (!std::setlocale(LC_ALL, "de_DE.UTF-8"))
      std::cout << "no locale de_DE.UTF-8: its part for C is skipped\n";
    std::locale::global(std::locale(std::locale::classic(), new Commas));
    std::ostringstream number;
    number << 1234.5;
    if (number.str() != "1.234,5")
      throw std::runtime_error("the locale has no effect");
    if (writeAndRead() != expected)
      throw std::runtime_error("the files depend on the locale");
  }
  catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}
