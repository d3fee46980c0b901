// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/scan_layouts.h"

#include "simulation/scan_containers.h"
#include "simulation/written_files.h"

#include <boost/algorithm/string/replace.hpp>
#include <boost/filesystem.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/core/eigen.hpp>

namespace bundle_icp {
namespace {

namespace fs = boost::filesystem;
using Json = nlohmann::json;

constexpr double TUM_SCALE = 5000, MILLIMETRES = 1000; // units a metre

std::string
stampOf(const SyntheticScan& scan, std::size_t index)
{
  return toText(scan.timestamp(index), std::chars_format::fixed, 6);
}

cv::Mat_<double>
matrixOf(const CameraIntrinsics& camera)
{
  return (cv::Mat_<double>(3, 3) << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
}

cv::Mat_<double>
matrixOf(const Pose& pose)
{
  cv::Mat_<double> matrix;
  cv::eigen2cv(Eigen::Matrix4d(pose.matrix()), matrix);
  return matrix;
}

/** `fx fy cx cy` and the units of depth. */
void
writeIntrinsics(const SyntheticScan& scan, const fs::path& folder, double units_per_metre)
{
  const CameraIntrinsics& camera = scan.camera();
  const cv::Mat_<double> numbers =
      (cv::Mat_<double>(1, 4) << camera.fx, camera.fy, camera.cx, camera.cy);
  writeText((folder / "intrinsics.txt").string(),
            toText(numbers) + "depth_scale " +
                toText(units_per_metre, std::chars_format::general, 6) + "\n");
}

void
writeTumLists(const SyntheticScan& scan, const fs::path& folder)
{
  for (const std::string kind : {"rgb", "depth"}) {
    std::string text = "# synthetic scan: timestamp [s], file\n";
    for (std::size_t i = 0; i < scan.size(); ++i)
      text += stampOf(scan, i) + " " + kind + "/" + stampOf(scan, i) + ".png\n";
    writeText((folder / (kind + ".txt")).string(), text);
  }
  writeIntrinsics(scan, folder, TUM_SCALE);
  writeTrajectory((folder / "groundtruth.txt").string(), scan.groundTruth());
}

/** Depth first, as ICL-NUIM has it. */
void
writeAssociations(const SyntheticScan& scan, const fs::path& folder)
{
  std::string text;
  for (std::size_t i = 0; i < scan.size(); ++i)
    text += stampOf(scan, i) + " depth/" + std::to_string(i) + ".png " + stampOf(scan, i) +
            " rgb/" + std::to_string(i) + ".png\n";
  writeText((folder / "associations.txt").string(), text);
  writeIntrinsics(scan, folder, TUM_SCALE);
  writeTrajectory((folder / "groundtruth.txt").string(), scan.groundTruth());
}

void
writePoseBesideFrame(const SyntheticScan& scan, const WrittenFrame& frame, const fs::path& folder)
{
  writeText((folder / ("frame-" + withZeros(frame.index, 6) + ".pose.txt")).string(),
            toText(matrixOf(scan.worldFromCamera(frame.index))));
}

void
writeThreeDMatchCamera(const SyntheticScan& scan, const fs::path& folder)
{
  writeText((folder / "camera-intrinsics.txt").string(), toText(matrixOf(scan.camera())));
}

void
writeOpen3dCamera(const SyntheticScan& scan, const fs::path& folder)
{
  const CameraIntrinsics& camera = scan.camera();
  const cv::Mat_<double> column_major = cv::Mat(matrixOf(camera).t()).reshape(1, 1);
  writeText((folder / "intrinsic.json").string(),
            "{\"width\": " + std::to_string(camera.width) +
                ", \"height\": " + std::to_string(camera.height) + ", \"intrinsic_matrix\": [" +
                toText(column_major, ", ") + "]}\n");
}

/** As depth comes from a phone: 2 is the highest confidence, 0 the lowest. */
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
        stampOf(scan, i) + ", " + withZeros(i, 6) + ", " +
        toText((cv::Mat_<double>(1, 7) << t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()), ", ");
  }
  writeText((folder / "odometry.csv").string(), text);
  writeText((folder / "camera_matrix.csv").string(), toText(matrixOf(scan.camera()), ", "));
}

/** Of a camera whose y axis points up and whose z axis points back. */
cv::Mat_<double>
openGlMatrixOf(const Pose& world_from_camera)
{
  cv::Mat_<double> matrix = matrixOf(world_from_camera);
  matrix.col(1) *= -1;
  matrix.col(2) *= -1;
  return matrix;
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

void
writeScanNetPose(const SyntheticScan& scan, const WrittenFrame& frame, const fs::path& folder)
{
  writeText((folder / "pose" / std::to_string(frame.index)).string() + ".txt",
            toText(matrixOf(scan.worldFromCamera(frame.index))));
}

void
writeScanNetCameras(const SyntheticScan& scan, const fs::path& folder)
{
  const CameraIntrinsics& camera = scan.camera();
  const cv::Mat_<double> intrinsic = (cv::Mat_<double>(4, 4) << camera.fx, 0, camera.cx, 0, 0,
                                      camera.fy, camera.cy, 0, 0, 0, 1, 0, 0, 0, 0, 1);
  for (const std::string kind : {"color", "depth"}) {
    writeText((folder / "intrinsic" / ("intrinsic_" + kind)).string() + ".txt", toText(intrinsic));
    writeText((folder / "intrinsic" / ("extrinsic_" + kind)).string() + ".txt",
              toText(matrixOf(Pose::Identity())));
  }
}

} // namespace

const std::vector<ScanLayout>&
scanLayouts()
{
  static const std::vector<ScanLayout> layouts = {
      {"tum", TUM_SCALE, "rgb/{stamp}.png", "depth/{stamp}.png", {}, nullptr, writeTumLists},
      {"associations",
       TUM_SCALE,
       "rgb/{number}.png",
       "depth/{number}.png",
       {},
       nullptr,
       writeAssociations},
      {"7-scenes",
       MILLIMETRES,
       "frame-{000000}.color.png",
       "frame-{000000}.depth.png",
       {},
       writePoseBesideFrame,
       writeThreeDMatchCamera},
      {"scannet",
       MILLIMETRES,
       "color/{number}.jpg",
       "depth/{number}.png",
       {"pose", "intrinsic"},
       writeScanNetPose,
       writeScanNetCameras},
      {"open3d",
       MILLIMETRES,
       "color/{000000}.png",
       "depth/{000000}.png",
       {},
       nullptr,
       writeOpen3dCamera},
      {"images",
       MILLIMETRES,
       "color{0000}.png",
       "depth{0000}.png",
       {},
       nullptr,
       [](const SyntheticScan& scan, const fs::path& folder) {
         writeIntrinsics(scan, folder, MILLIMETRES);
       }},
      {"stray-scanner",
       MILLIMETRES,
       "rgb/{000000}.png",
       "depth/{000000}.png",
       {"confidence"},
       writeConfidence,
       writeStrayScannerLists},
      {"nerfstudio",
       MILLIMETRES,
       "images/frame_{000000}.png",
       "depth/frame_{000000}.png",
       {},
       nullptr,
       writeTransforms},
      {"polycam",
       MILLIMETRES,
       "keyframes/images/{microseconds}.jpg",
       "keyframes/depth/{microseconds}.png",
       {"keyframes/cameras"},
       writePolycamCamera,
       nullptr},
      {"pcd", MILLIMETRES, "", "", {}, writePcd, nullptr},
      {"sens", MILLIMETRES, "", "", {}, writeSensPart, joinSensParts},
  };
  return layouts;
}

std::string
nameOfFrame(const char* pattern, const SyntheticScan& scan, std::size_t index)
{
  std::string name = pattern;
  boost::replace_all(name, "{stamp}", stampOf(scan, index));
  boost::replace_all(name, "{microseconds}",
                     toText(1e6 * scan.timestamp(index), std::chars_format::fixed, 0));
  boost::replace_all(name, "{number}", std::to_string(index));
  for (const std::string zeros : {"0000", "000000"})
    boost::replace_all(name, "{" + zeros + "}", withZeros(index, zeros.size()));
  return name;
}

const ScanLayout*
findScanLayout(const std::string& name)
{
  for (const ScanLayout& layout : scanLayouts())
    if (name == layout.name)
      return &layout;
  return nullptr;
}

} // namespace bundle_icp
