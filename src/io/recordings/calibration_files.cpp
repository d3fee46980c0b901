// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/calibration_files.h"

#include "io/text_file.h"

#include <boost/algorithm/string.hpp>
#include <boost/filesystem.hpp>
#include <nlohmann/json.hpp>
#include <pcl/exceptions.h>

#include <cmath>
#include <map>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

using Json = nlohmann::json;

/** Focal length and centre of a matrix of 3x3 or 4x4, row by row. */
CameraIntrinsics
fromMatrix(const std::vector<double>& values, const std::string& path)
{
  const std::size_t width = values.size() == 16 ? 4 : 3;
  if (values.size() != width * width || values[1] != 0 || values[width] != 0)
    throw pcl::IOException(path + ": expected a matrix fx 0 cx, 0 fy cy, 0 0 1");
  CameraIntrinsics camera;
  camera.fx = values[0];
  camera.fy = values[width + 1];
  camera.cx = values[2];
  camera.cy = values[width + 2];
  return camera;
}

/** A line `fx fy cx cy [k1 k2 p1 p2 k3]` or three lines of a matrix, optionally one `depth_scale
 *  5000`. */
void
readText(const std::string& path, Recording& recording)
{
  std::vector<double> matrix;
  for (TextLine line : readTextLines(path)) {
    const bool is_scale = line.words[0] == "depth_scale";
    if (is_scale)
      line.words.erase(line.words.begin());
    const std::vector<double> values = parseNumbers(line, path);
    if (is_scale && values.size() == 1 && values[0] > 0) {
      recording.depth_scale = values[0];
      recording.depth_scale_source = path;
    }
    else if (!is_scale && values.size() == 3 && matrix.size() < 9) {
      matrix.insert(matrix.end(), values.begin(), values.end());
    }
    else if (!is_scale && (values.size() == 4 || values.size() == 9)) {
      std::string text;
      for (const std::string& word : line.words)
        text += word + " ";
      recording.intrinsics = parseIntrinsics(text);
    }
    else
      throw pcl::IOException(path + ":" + std::to_string(line.number) +
                             ": expected fx fy cx cy [k1 k2 p1 p2 k3] or depth_scale "
                             "UNITS_PER_METRE");
  }
  if (matrix.size() == 9)
    recording.intrinsics = fromMatrix(matrix, path);
  else if (!matrix.empty())
    throw pcl::IOException(path + ":1: expected fx fy cx cy [k1 k2 p1 p2 k3] or a matrix of 3x3");
}

/** Text in UTF-8 of bytes that may be UTF-16, as some recorders write. */
std::string
toUtf8(const std::string& bytes)
{
  const bool is_little = bytes.compare(0, 2, "\xff\xfe") == 0;
  if (!is_little && bytes.compare(0, 2, "\xfe\xff") != 0)
    return bytes;
  std::string text; // a calibration is ASCII
  for (std::size_t i = 2; i + 1 < bytes.size(); i += 2)
    text += bytes[i + 1 - std::size_t(is_little)];
  return text;
}

/** Intrinsics of `intrinsic_matrix`: 9 numbers column by column, as Open3D writes it, or 3 rows. */
CameraIntrinsics
fromJsonMatrix(const Json& json, const std::string& path)
{
  if (json.is_array() && json.size() == 3 && json[0].is_array()) {
    std::vector<double> rows;
    for (const auto& row : json.get<std::vector<std::vector<double>>>())
      rows.insert(rows.end(), row.begin(), row.end());
    return fromMatrix(rows, path);
  }
  const auto matrix = json.get<std::vector<double>>();
  // A row-major matrix would silently lose its centre.
  if (matrix.size() != 9 || matrix[2] != 0 || matrix[5] != 0)
    throw pcl::IOException(path + ": intrinsic_matrix must be 9 numbers, column by column: " +
                           "fx 0 0 0 fy 0 cx cy 1");
  return fromMatrix({matrix[0], matrix[3], matrix[6], matrix[1], matrix[4], matrix[7], matrix[2],
                     matrix[5], matrix[8]},
                    path);
}

CameraIntrinsics
fromJson(const Json& json, const std::string& path)
{
  if (json.contains("intrinsic") && json["intrinsic"].is_object())
    return fromJson(json["intrinsic"], path);
  CameraIntrinsics camera;
  if (!json.contains("intrinsic_matrix") && json.contains("fx")) {
    camera.fx = json.at("fx");
    camera.fy = json.at("fy");
    camera.cx = json.contains("ppx") ? json["ppx"] : json.at("cx");
    camera.cy = json.contains("ppy") ? json["ppy"] : json.at("cy");
    const auto distortion = json.value("coeffs", std::vector<double>());
    const std::string model = json.value("model", "");
    if (std::any_of(distortion.begin(), distortion.end(), [](double x) { return x != 0; }))
      throw pcl::IOException(path + ": the distortion (model '" + model +
                             "') cannot be told apart from its inverse; give it with --intrinsics");
  }
  else
    camera = fromJsonMatrix(json.at("intrinsic_matrix"), path);
  camera.width = json.value("width", 0);
  camera.height = json.value("height", 0);
  return camera;
}

void
readJson(const std::string& path, Recording& recording)
{
  try {
    const Json json = Json::parse(toUtf8(readBytes(path)));
    recording.intrinsics = fromJson(json, path);
    if (json.contains("depth_scale")) {
      recording.depth_scale = json["depth_scale"];
      recording.depth_scale_source = path;
    }
  }
  catch (const Json::exception& error) {
    throw pcl::IOException(path + ": is not a calibration of a known form: " + error.what());
  }
}

} // namespace

bool
readCalibrationFile(const std::string& folder, Recording& recording)
{
  for (const char* const name :
       {"intrinsics.txt", "intrinsic.json", "camera_intrinsic.json", "intrinsics.json",
        "camera_intrinsics.json", "camera.json", "camera-intrinsics.txt", "intrinsic.txt"}) {
    const std::string path = (fs::path(folder) / name).string();
    if (!fs::exists(path))
      continue;
    recording.intrinsics_source = path;
    fs::path(path).extension() == ".json" ? readJson(path, recording) : readText(path, recording);
    return true;
  }
  return readSensorInfo(folder, recording);
}

bool
readSensorInfo(const std::string& folder, Recording& recording)
{
  std::string path;
  for (const char* const name : {"_info.txt", "info.txt"})
    if (path.empty() && fs::exists(fs::path(folder) / name))
      path = (fs::path(folder) / name).string();
  if (path.empty())
    return false;
  std::map<std::string, std::vector<double>> values; // of "NAME = NUMBER..."
  for (TextLine line : readTextLines(path)) {
    if (line.words.size() < 3 || line.words[1] != "=" || line.words[0] == "m_sensorName")
      continue;
    const std::string name = line.words[0];
    line.words.erase(line.words.begin(), line.words.begin() + 2);
    values[name] = parseNumbers(line, path);
  }
  const auto number = [&](const std::string& name) {
    return values[name].size() == 1 ? values[name][0] : 0;
  };
  // Frames have one size: where the recorder's differ, colour was brought to that of depth.
  const bool is_equal = number("m_colorWidth") == number("m_depthWidth");
  const std::string kind = is_equal ? "Color" : "Depth", size = is_equal ? "color" : "depth";
  recording.intrinsics = fromMatrix(values["m_calibration" + kind + "Intrinsic"], path);
  recording.intrinsics->width = int(number("m_" + size + "Width"));
  recording.intrinsics->height = int(number("m_" + size + "Height"));
  recording.intrinsics_source = path;
  if (number("m_depthShift") > 0) {
    recording.depth_scale = number("m_depthShift");
    recording.depth_scale_source = path;
  }
  return true;
}

std::vector<std::string>
possibleCalibrationFiles(const std::string& folder)
{
  std::vector<std::string> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = boost::to_lower_copy(entry.path().filename().string());
    for (const char* const word : {"intrin", "calib", "camera"})
      if (fs::is_regular_file(entry.status()) && name.find(word) != std::string::npos) {
        files.push_back(entry.path().filename().string());
        break;
      }
  }
  std::sort(files.begin(), files.end());
  return files;
}

} // namespace bundle_icp
