// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "recording.h"
#include "temporary_folder.h"

#include <opencv2/imgcodecs.hpp>

#include <cstdio>
#include <stdexcept>

namespace adversity {
namespace {

std::string
seconds(double time)
{
  char text[64];
  std::snprintf(text, sizeof(text), "%.6f", time);
  return text;
}

void
writeImage(const std::string& path, const cv::Mat& pixels)
{
  // Level 1: time would go into compression otherwise.
  if (!cv::imwrite(path, pixels, {cv::IMWRITE_PNG_COMPRESSION, 1}))
    throw std::runtime_error(path + ": cannot be written");
}

/** Where an image lies in the folder. */
std::string
fileOf(const Recording& recording, const Image& image, bool is_color)
{
  const std::string extension = is_color ? recording.color_extension : recording.depth_extension;
  switch (recording.layout) {
  case Layout::SEVEN_SCENES:
    return image.name + (is_color ? ".color" : ".depth") + extension;
  case Layout::OPEN3D:
    return (is_color ? "color/" : "depth/") + image.name + extension;
  default:
    return (is_color ? "rgb/" : "depth/") + image.name + extension;
  }
}

void
writeLists(const Recording& recording, const std::string& folder)
{
  const auto row = [&](const Image& image, bool is_color) {
    return (recording.stamp ? recording.stamp(image.time) : seconds(image.time)) + " " +
           fileOf(recording, image, is_color);
  };
  std::string rgb, depth, both;
  for (const Image& image : recording.color)
    rgb += row(image, true) + "\n";
  for (const Image& image : recording.depth)
    depth += row(image, false) + "\n";
  if (recording.layout == Layout::TUM) {
    writeText(folder + "/rgb.txt", rgb);
    writeText(folder + "/depth.txt", depth);
    return;
  }
  for (std::size_t i = 0; i < recording.color.size(); ++i)
    both += row(recording.color[i], true) + " " + row(recording.depth.at(i), false) + "\n";
  writeText(folder + "/associations.txt", both);
}

void
writeCalibration(const Recording& recording, const std::string& folder)
{
  const bundle_icp::CameraIntrinsics& c = recording.camera;
  char text[512];
  switch (recording.layout) {
  case Layout::OPEN3D:
    std::snprintf(text, sizeof(text),
                  "{\"width\": %d, \"height\": %d, \"intrinsic_matrix\": "
                  "[%.9g, 0, 0, 0, %.9g, 0, %.9g, %.9g, 1]}\n",
                  c.width, c.height, c.fx, c.fy, c.cx, c.cy);
    return writeText(folder + "/intrinsic.json", text);
  case Layout::SEVEN_SCENES:
    std::snprintf(text, sizeof(text), "%.9g 0 %.9g\n0 %.9g %.9g\n0 0 1\n", c.fx, c.cx, c.fy, c.cy);
    return writeText(folder + "/camera-intrinsics.txt", text);
  default:
    std::snprintf(text, sizeof(text), "%.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", c.fx, c.fy,
                  c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3);
    std::string lines = text;
    if (recording.depth_scale != 5000)
      lines += "depth_scale " + seconds(recording.depth_scale) + "\n";
    return writeText(folder + "/intrinsics.txt", lines);
  }
}

} // namespace

Places
write(const Recording& recording, const std::string& folder)
{
  namespace fs = boost::filesystem;
  fs::create_directories(folder);
  Places places;
  for (const bool is_color : {true, false})
    for (const Image& image : is_color ? recording.color : recording.depth) {
      const std::string file = fileOf(recording, image, is_color);
      fs::create_directories(fs::path(folder + "/" + file).parent_path());
      writeImage(folder + "/" + file, image.pixels);
      if (is_color)
        places[file] = image.place;
    }
  if (recording.layout == Layout::TUM || recording.layout == Layout::ONE_LIST)
    writeLists(recording, folder);
  if (recording.has_calibration)
    writeCalibration(recording, folder);
  if (recording.afterwards)
    recording.afterwards(folder);
  return places;
}

} // namespace adversity
