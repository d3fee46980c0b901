// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/phone_layouts.h"

#include "simulation/written_files.h"

#include <boost/filesystem.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

namespace bundle_icp {

namespace fs = boost::filesystem;
using Json = nlohmann::json;

namespace {

/** Of a camera whose y axis points up and whose z axis points back. */
cv::Mat_<double>
openGlMatrixOf(const Pose& world_from_camera)
{
  cv::Mat_<double> matrix = matrixOf(world_from_camera);
  matrix.col(1) *= -1;
  matrix.col(2) *= -1;
  return matrix;
}

} // namespace

void
writeConfidence(const SyntheticScan&, const WrittenFrame& frame, const fs::path& folder)
{
  cv::Mat confidence(frame.depth_units.size(), CV_8UC1, cv::Scalar(2));
  confidence.setTo(0, frame.depth_units == 0);
  writeImage((folder / "confidence" / withZeros(frame.index, 6)).string() + ".png", confidence);
}

void
writeStrayScannerLists(const SyntheticScan& scan, const fs::path& folder)
{
  std::string text = "timestamp, frame, x, y, z, qx, qy, qz, qw\n";
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Pose pose = scan.worldFromCamera(i);
    const Eigen::Vector3d& t = pose.translation();
    const Eigen::Quaterniond q(pose.linear());
    text +=
        nameOfFrame("{stamp}", scan, i) + ", " + withZeros(i, 6) + ", " +
        toText((cv::Mat_<double>(1, 7) << t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()), ", ");
  }
  writeText((folder / "odometry.csv").string(), text);
  writeText((folder / "camera_matrix.csv").string(), toText(matrixOf(scan.camera()), ", "));
}

void
writeTransforms(const SyntheticScan& scan, const fs::path& folder)
{
  const CameraIntrinsics& camera = scan.camera();
  Json json = {{"camera_model", "OPENCV"}, {"fl_x", camera.fx}, {"fl_y", camera.fy},
               {"cx", camera.cx},          {"cy", camera.cy},   {"w", camera.width},
               {"h", camera.height}};
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const cv::Mat_<double> m = openGlMatrixOf(scan.worldFromCamera(i));
    Json rows;
    for (int row = 0; row < 4; ++row)
      rows.push_back(std::vector<double>(m[row], m[row] + 4));
    json["frames"].push_back({{"file_path", "images/frame_" + withZeros(i, 6) + ".png"},
                              {"depth_file_path", "depth/frame_" + withZeros(i, 6) + ".png"},
                              {"transform_matrix", rows}});
  }
  writeText((folder / "transforms.json").string(), json.dump(1) + "\n");
}

void
writePolycamCamera(const SyntheticScan& scan, const WrittenFrame& frame, const fs::path& folder)
{
  const CameraIntrinsics& camera = scan.camera();
  Json json = {{"fx", camera.fx}, {"fy", camera.fy},       {"cx", camera.cx},
               {"cy", camera.cy}, {"width", camera.width}, {"height", camera.height}};
  const cv::Mat_<double> m = openGlMatrixOf(scan.worldFromCamera(frame.index));
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      json["t_" + std::to_string(row) + std::to_string(column)] = m(row, column);
  const std::string name = nameOfFrame("{microseconds}.json", scan, frame.index);
  writeText((folder / "keyframes" / "cameras" / name).string(), json.dump(1) + "\n");
}

} // namespace bundle_icp
