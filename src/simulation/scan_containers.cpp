// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/scan_containers.h"

#include "simulation/written_files.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/io/atomic_file.h>

#include <boost/filesystem.hpp>
#include <opencv2/imgcodecs.hpp>
#include <zlib.h>

#include <fstream>
#include <limits>

namespace bundle_icp {
namespace {

namespace fs = boost::filesystem;

template <class Number>
void
append(std::string& bytes, Number number)
{
  bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
}

void
append(std::string& bytes, const Eigen::Matrix4d& matrix)
{
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      append(bytes, float(matrix(row, column)));
}

std::string
pcdHeader(const CameraIntrinsics& camera, const Pose& pose)
{
  const Eigen::Vector3d& t = pose.translation();
  const Eigen::Quaterniond q(pose.linear());
  const std::string width = std::to_string(camera.width), height = std::to_string(camera.height);
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb\n"
         "SIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH " +
         width + "\nHEIGHT " + height + "\nVIEWPOINT " +
         toText((cv::Mat_<double>(1, 7) << t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z())) +
         "POINTS " + std::to_string(camera.width * camera.height) + "\nDATA binary\n";
}

fs::path
sensPart(const fs::path& folder, std::size_t index)
{
  return folder / (std::to_string(index) + ".part");
}

std::string
sensHeader(const SyntheticScan& scan)
{
  const std::optional<DepthCamera> depth = scan.depthCamera();
  const CameraIntrinsics cameras[] = {scan.camera(), depth ? depth->intrinsics : scan.camera()};
  const std::string sensor = "synthetic";
  std::string bytes;
  append(bytes, std::uint32_t(4)); // version
  append(bytes, std::uint64_t(sensor.size()));
  bytes += sensor;
  for (const CameraIntrinsics& camera : cameras) {
    Eigen::Matrix4d intrinsic = Eigen::Matrix4d::Identity();
    intrinsic(0, 0) = camera.fx;
    intrinsic(1, 1) = camera.fy;
    intrinsic(0, 2) = camera.cx;
    intrinsic(1, 2) = camera.cy;
    append(bytes, intrinsic);
    append(bytes, Eigen::Matrix4d(Eigen::Matrix4d::Identity()));
  }
  append(bytes, std::int32_t(1)); // colour as PNG
  append(bytes, std::int32_t(1)); // depth by zlib
  for (const CameraIntrinsics& camera : cameras) {
    append(bytes, std::uint32_t(camera.width));
    append(bytes, std::uint32_t(camera.height));
  }
  append(bytes, 1000.f); // units a metre
  append(bytes, std::uint64_t(scan.size()));
  return bytes;
}

} // namespace

void
writePcd(const SyntheticScan& scan, const WrittenFrame& frame, const fs::path& folder)
{
  const CameraIntrinsics& camera = scan.camera();
  std::string bytes = pcdHeader(camera, scan.worldFromCamera(frame.index));
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const std::uint16_t units = frame.depth_units.at<std::uint16_t>(v, u);
      const float z = units == 0 ? std::numeric_limits<float>::quiet_NaN() : float(units) / 1000.f;
      const Eigen::Vector3f point = camera.unproject(u, v, double(z)).cast<float>();
      append(bytes, point.x());
      append(bytes, point.y());
      append(bytes, z);
      const cv::Vec3b& bgr = frame.color.at<cv::Vec3b>(v, u);
      for (int k = 0; k < 3; ++k)
        append(bytes, bgr[k]);
      append(bytes, std::uint8_t(0));
    }
  writeBytes((folder / ("cloud" + withZeros(frame.index, 4) + ".pcd")).string(), bytes.data(),
             bytes.size());
}

void
writeSensPart(const SyntheticScan& scan, const WrittenFrame& frame, const fs::path& folder)
{
  std::vector<uchar> color;
  cv::imencode(".png", frame.color, color, {cv::IMWRITE_PNG_COMPRESSION, 1});
  const uLong size = uLong(frame.depth_units.total() * frame.depth_units.elemSize());
  std::vector<Bytef> depth(compressBound(size));
  uLongf depth_size = uLongf(depth.size());
  compress2(depth.data(), &depth_size, frame.depth_units.data, size, 1);
  const auto stamp = std::uint64_t(std::llround(1e6 * scan.timestamp(frame.index)));
  std::string bytes;
  append(bytes, Eigen::Matrix4d(scan.worldFromCamera(frame.index).matrix()));
  append(bytes, stamp); // of colour
  append(bytes, stamp); // of depth
  append(bytes, std::uint64_t(color.size()));
  append(bytes, std::uint64_t(depth_size));
  bytes.append(color.begin(), color.end());
  bytes.append(reinterpret_cast<const char*>(depth.data()), depth_size);
  writeBytes(sensPart(folder, frame.index).string(), bytes.data(), bytes.size());
}

void
joinSensParts(const SyntheticScan& scan, const fs::path& folder)
{
  const std::string path = (folder / "scan.sens").string();
  writeAtomically(path, [&](const std::string& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    file << sensHeader(scan);
    for (std::size_t i = 0; i < scan.size(); ++i)
      file << std::ifstream(sensPart(folder, i).string(), std::ios::binary).rdbuf();
    const std::string no_imu(sizeof(std::uint64_t), '\0');
    file << no_imu;
    file.close();
    if (!file)
      throw IOException("cannot write '" + path + "': disk full or not writable");
  });
  for (std::size_t i = 0; i < scan.size(); ++i)
    fs::remove(sensPart(folder, i));
}

} // namespace bundle_icp
