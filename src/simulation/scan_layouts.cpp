// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/scan_layouts.h"

#include "simulation/phone_layouts.h"
#include "simulation/scan_containers.h"
#include "simulation/written_files.h"

#include <boost/algorithm/string/replace.hpp>
#include <boost/filesystem.hpp>

#include <cmath>

namespace bundle_icp {
namespace {

namespace fs = boost::filesystem;

constexpr double TUM_SCALE = 5000, MILLIMETRES = 1000; // units a metre

std::string
stampOf(const SyntheticScan& scan, std::size_t index)
{
  return toText(scan.timestamp(index), std::chars_format::fixed, 6);
}

cv::Mat_<double>
focalLengthsAndCentre(const CameraIntrinsics& camera)
{
  return (cv::Mat_<double>(1, 4) << camera.fx, camera.fy, camera.cx, camera.cy);
}

/** Camera of the depth images. */
CameraIntrinsics
depthIntrinsics(const SyntheticScan& scan)
{
  const std::optional<DepthCamera> depth = scan.depthCamera();
  return depth ? depth->intrinsics : scan.camera();
}

/** `fx fy cx cy`, the units of depth and its camera. */
void
writeIntrinsics(const SyntheticScan& scan, const fs::path& folder, double units_per_metre)
{
  std::string text = toText(focalLengthsAndCentre(scan.camera())) + "depth_scale " +
                     toText(units_per_metre, std::chars_format::general, 6) + "\n";
  if (const std::optional<DepthCamera> depth = scan.depthCamera()) {
    const Eigen::Vector3d place = depth->color_from_depth.translation();
    text += "depth_intrinsics " + toText(focalLengthsAndCentre(depth->intrinsics));
    text += "depth_to_color " + toText((cv::Mat_<double>(1, 3) << place.x(), place.y(), place.z()));
  }
  writeText((folder / "intrinsics.txt").string(), text);
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

void
writeScanNetPose(const SyntheticScan& scan, const WrittenFrame& frame, const fs::path& folder)
{
  writeText((folder / "pose" / std::to_string(frame.index)).string() + ".txt",
            toText(matrixOf(scan.worldFromCamera(frame.index))));
}

void
writeScanNetCameras(const SyntheticScan& scan, const fs::path& folder)
{
  const std::pair<std::string, CameraIntrinsics> cameras[] = {{"color", scan.camera()},
                                                              {"depth", depthIntrinsics(scan)}};
  for (const auto& [kind, camera] : cameras) {
    const cv::Mat_<double> intrinsic = (cv::Mat_<double>(4, 4) << camera.fx, 0, camera.cx, 0, 0,
                                        camera.fy, camera.cy, 0, 0, 0, 1, 0, 0, 0, 0, 1);
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
      {"tum",
       DepthView::ANY,
       TUM_SCALE,
       "rgb/{stamp}.png",
       "depth/{stamp}.png",
       {},
       nullptr,
       writeTumLists},
      {"associations",
       DepthView::ANY,
       TUM_SCALE,
       "rgb/{number}.png",
       "depth/{number}.png",
       {},
       nullptr,
       writeAssociations},
      {"7-scenes",
       DepthView::SAME,
       MILLIMETRES,
       "frame-{000000}.color.png",
       "frame-{000000}.depth.png",
       {},
       writePoseBesideFrame,
       writeThreeDMatchCamera},
      {"scannet",
       DepthView::SAME_PLACE,
       MILLIMETRES,
       "color/{number}.jpg",
       "depth/{number}.png",
       {"pose", "intrinsic"},
       writeScanNetPose,
       writeScanNetCameras},
      {"open3d",
       DepthView::SAME,
       MILLIMETRES,
       "color/{000000}.png",
       "depth/{000000}.png",
       {},
       nullptr,
       writeOpen3dCamera},
      {"images",
       DepthView::ANY,
       MILLIMETRES,
       "color{0000}.png",
       "depth{0000}.png",
       {},
       nullptr,
       [](const SyntheticScan& scan, const fs::path& folder) {
         writeIntrinsics(scan, folder, MILLIMETRES);
       }},
      {"stray-scanner",
       DepthView::SAME,
       MILLIMETRES,
       "rgb/{000000}.png",
       "depth/{000000}.png",
       {"confidence"},
       writeConfidence,
       writeStrayScannerLists},
      {"nerfstudio",
       DepthView::SAME,
       MILLIMETRES,
       "images/frame_{000000}.png",
       "depth/frame_{000000}.png",
       {},
       nullptr,
       writeTransforms},
      {"polycam",
       DepthView::SAME,
       MILLIMETRES,
       "keyframes/images/{microseconds}.jpg",
       "keyframes/depth/{microseconds}.png",
       {"keyframes/cameras"},
       writePolycamCamera,
       nullptr},
      {"pcd", DepthView::REGISTERED, MILLIMETRES, "", "", {}, writePcd, nullptr},
      {"sens", DepthView::SAME_PLACE, MILLIMETRES, "", "", {}, writeSensPart, joinSensParts},
  };
  return layouts;
}

DepthView
depthViewOf(const SyntheticScan& scan)
{
  const std::optional<DepthCamera> depth = scan.depthCamera();
  if (!depth)
    return DepthView::REGISTERED;
  if (!depth->color_from_depth.isApprox(Pose::Identity()))
    return DepthView::ANY;
  const CameraIntrinsics &of_depth = depth->intrinsics, &of_color = scan.camera();
  const double scale = double(of_depth.width) / of_color.width;
  const bool is_same = of_depth.width * of_color.height == of_depth.height * of_color.width &&
                       std::abs(of_depth.fx - scale * of_color.fx) < 1e-6;
  return is_same ? DepthView::SAME : DepthView::SAME_PLACE;
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
