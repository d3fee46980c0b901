// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "temporary_folder.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <cstdint>
#include <string>

/** Small recordings for tests. */
namespace recordings {

inline cv::Mat
color(int index, const cv::Size& size = {64, 48})
{
  cv::Mat image(size, CV_8UC3);
  cv::RNG random(index + 1);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

inline cv::Mat
depth(int units, const cv::Size& size = {64, 48})
{
  return cv::Mat(size, CV_16UC1, cv::Scalar(units));
}

inline void
writeImage(const std::string& path, const cv::Mat& image)
{
  boost::filesystem::create_directories(boost::filesystem::path(path).parent_path());
  cv::imwrite(path, image);
}

/** Cuts a file off after a share of its bytes. */
inline void
truncate(const std::string& path, double share)
{
  const std::string bytes = readText(path);
  writeText(path, bytes.substr(0, std::size_t(share * bytes.size())));
}

/** A TUM folder with frames at 0, 0.1, ... s, depth 4 ms later, of 1, 1.1, ... m, and a
 * camera of 60 px without distortion. */
inline void
writeTum(const std::string& folder, int num_frames, const cv::Size& size = {64, 48})
{
  std::string rgb = "# color images\n", depths = "# depth images\n";
  for (int i = 0; i < num_frames; ++i) {
    const std::string name = "/" + std::to_string(i) + ".png";
    writeImage(folder + "/rgb" + name, color(i, size));
    writeImage(folder + "/depth" + name, depth(5000 + 500 * i, size));
    rgb += std::to_string(0.1 * i) + " rgb" + name + "\n";
    depths += std::to_string(0.1 * i + 0.004) + " depth" + name + "\n";
  }
  writeText(folder + "/rgb.txt", rgb);
  writeText(folder + "/depth.txt", depths);
  writeText(folder + "/intrinsics.txt",
            "60 60 " + std::to_string(size.width / 2) + " " + std::to_string(size.height / 2));
}

/** An Open3D folder with frames 0, 1, ... of 1, 1.1, ... m. */
inline void
writeOpen3d(const std::string& folder, int num_frames)
{
  for (int i = 0; i < num_frames; ++i) {
    writeImage(folder + "/color/" + std::to_string(i) + ".png", color(i));
    writeImage(folder + "/depth/" + std::to_string(i) + ".png", depth(1000 + 100 * i));
  }
  writeText(folder + "/intrinsic.json",
            R"({"width": 64, "height": 48,
                "intrinsic_matrix": [60, 0, 0, 0, 61, 0, 32, 24, 1]})");
}

/** "frame-000012", as 7-Scenes names it. */
inline std::string
sevenScenesName(int number)
{
  const std::string digits = std::to_string(number);
  return "frame-" + std::string(6 - digits.size(), '0') + digits;
}

/** One frame of a 7-Scenes folder, with the identity as pose. */
inline void
writeSevenScenesFrame(const std::string& folder, int number, const cv::Mat& color_image,
                      const cv::Mat& depth_image)
{
  const std::string start = folder + "/" + sevenScenesName(number);
  writeImage(start + ".color.png", color_image);
  writeImage(start + ".depth.png", depth_image);
  writeText(start + ".pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
}

} // namespace recordings
