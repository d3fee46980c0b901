// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/dataset_formats.h"
#include "io/text_file.h"

#include <pcl/exceptions.h>

#include <boost/algorithm/string/case_conv.hpp>
#include <boost/filesystem.hpp>
#include <nlohmann/json.hpp>

#include <map>
#include <set>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

// The first number in a file's name: Redwood writes 000012-000000400000.png, number and
// time.
std::optional<std::size_t>
numberInName(const fs::path& file)
{
  const std::string stem = file.stem().string(), digits = "0123456789";
  const std::size_t begin = stem.find_first_of(digits);
  if (begin == std::string::npos)
    return std::nullopt;
  const std::size_t end = std::min(stem.find_first_not_of(digits, begin), stem.size());
  if (end - begin > 18)
    return std::nullopt;
  return std::stoull(stem.substr(begin, end - begin));
}

// "2.png" before "10.png": by number first, by name where that is the same or missing.
bool
naturalLess(const fs::path& a, const fs::path& b)
{
  return std::make_pair(numberInName(a), a.filename()) <
         std::make_pair(numberInName(b), b.filename());
}

std::vector<fs::path>
listImages(const fs::path& folder)
{
  const std::set<std::string> extensions = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"};
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (extensions.count(boost::to_lower_copy(entry.path().extension().string())) &&
        entry.path().filename().string().front() != '.')
      files.push_back(entry.path());
  std::sort(files.begin(), files.end(), naturalLess);
  if (files.empty())
    throw pcl::IOException(folder.string() + ": the folder holds no image");
  return files;
}

// The files by their numbers; empty when these do not tell all files apart.
std::map<std::size_t, fs::path>
byNumber(const std::vector<fs::path>& files)
{
  std::map<std::size_t, fs::path> numbered;
  for (const fs::path& file : files) {
    const auto number = numberInName(file);
    if (!number || !numbered.emplace(*number, file).second)
      return {};
  }
  return numbered;
}

void
pairByNumber(const std::map<std::size_t, fs::path>& color,
             const std::map<std::size_t, fs::path>& depth, Recording& recording)
{
  for (const auto& [number, file] : color) {
    const auto partner = depth.find(number);
    if (partner != depth.end())
      recording.frames.push_back({number, number / 30.0, file.string(), partner->second.string()});
    else
      recording.skipped.push_back({file.string(), "has no depth image of its number"});
  }
  for (const auto& [number, file] : depth)
    if (color.count(number) == 0)
      recording.skipped.push_back({file.string(), "has no colour image of its number"});
}

fs::path
colorFolder(const fs::path& folder)
{
  for (const char* const name : {"color", "image", "rgb"})
    if (fs::is_directory(folder / name))
      return folder / name;
  return {};
}

void
collectFrames(const std::string& folder, Recording& recording)
{
  const std::vector<fs::path> color = listImages(colorFolder(folder));
  const std::vector<fs::path> depth = listImages(fs::path(folder) / "depth");
  const auto numbered_color = byNumber(color), numbered_depth = byNumber(depth);
  if (!numbered_color.empty() && !numbered_depth.empty()) {
    pairByNumber(numbered_color, numbered_depth, recording);
  }
  else if (color.size() == depth.size()) {
    for (std::size_t i = 0; i < color.size(); ++i)
      recording.frames.push_back({i, i / 30.0, color[i].string(), depth[i].string()});
  }
  else
    throw pcl::IOException(folder + ": " + std::to_string(color.size()) + " colour and " +
                           std::to_string(depth.size()) +
                           " depth images whose names do not say which belong together");
  if (recording.frames.empty())
    throw pcl::IOException(folder + ": no colour image has a depth image of its number");
}

void
parseIntrinsicsFile(const std::string& path, Recording& recording)
{
  const nlohmann::json json = nlohmann::json::parse(readBytes(path));
  const auto matrix = json.at("intrinsic_matrix").get<std::vector<double>>();
  // Column-major, as Open3D writes it; a row-major matrix would silently lose its
  // centre.
  if (matrix.size() != 9 || matrix[2] != 0 || matrix[5] != 0)
    throw pcl::IOException(path + ": intrinsic_matrix must be 9 numbers, column by column: " +
                           "fx 0 0 0 fy 0 cx cy 1");
  CameraIntrinsics intrinsics;
  intrinsics.width = json.value("width", 0);
  intrinsics.height = json.value("height", 0);
  intrinsics.fx = matrix[0];
  intrinsics.fy = matrix[4];
  intrinsics.cx = matrix[6];
  intrinsics.cy = matrix[7];
  recording.intrinsics = intrinsics;
  recording.intrinsics_source = path;
  recording.depth_scale = json.value("depth_scale", 1000.0);
}

void
findCalibration(const std::string& folder, Recording& recording)
{
  for (const char* const name : {"intrinsic.json", "camera_intrinsic.json"}) {
    const std::string path = (fs::path(folder) / name).string();
    if (recording.intrinsics || !fs::exists(path))
      continue;
    try {
      parseIntrinsicsFile(path, recording);
    }
    catch (const nlohmann::json::exception& error) {
      throw pcl::IOException(path + ": " + error.what());
    }
  }
}

} // namespace

bool
isOpen3dFolder(const std::string& folder)
{
  return !colorFolder(folder).empty() && fs::is_directory(fs::path(folder) / "depth");
}

Recording
readOpen3dFolder(const std::string& folder)
{
  Recording recording;
  recording.format = "Open3D";
  recording.depth_scale = 1000;
  collectFrames(folder, recording);
  findCalibration(folder, recording);
  return recording;
}

} // namespace bundle_icp
