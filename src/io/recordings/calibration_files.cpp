// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/calibration_files.h"

#include "io/pose_numbers.h"
#include "io/recordings/calibration_json.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/algorithm/string.hpp>
#include <boost/filesystem.hpp>

#include <cmath>
#include <map>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

/** Focal length and centre of a matrix of 3x3 or 4x4, row by row. */
CameraIntrinsics
fromMatrix(const std::vector<double>& values, const std::string& path)
{
  const std::size_t width = values.size() == 16 ? 4 : 3;
  if (values.size() != width * width || values[1] != 0 || values[width] != 0 ||
      values[2 * width] != 0 || values[2 * width + 1] != 0 || values[2 * width + 2] != 1)
    throw IOException(path + ": expected a matrix fx 0 cx, 0 fy cy, 0 0 1");
  CameraIntrinsics camera;
  camera.fx = values[0];
  camera.fy = values[width + 1];
  camera.cx = values[2];
  camera.cy = values[width + 2];
  return camera;
}

CameraIntrinsics
fromWords(const TextLine& line)
{
  std::string text;
  for (const std::string& word : line.words)
    text += word + " ";
  return parseIntrinsics(text);
}

/** Takes a line that begins with the name of what it holds. */
void
readNamedLine(const std::string& name, const TextLine& line, const std::string& path,
              Recording& recording)
{
  const std::vector<double> values = parseNumbers(line, path);
  if (name == "depth_scale" && values.size() == 1 && values[0] > 0) {
    recording.depth_scale = values[0];
    recording.depth_scale_source = path;
    return;
  }
  const std::string where = path + ":" + std::to_string(line.number);
  if (name == "depth_scale")
    throw IOException(where + ": expected depth_scale UNITS_PER_METRE");
  if (!recording.depth_camera)
    recording.depth_camera.emplace();
  if (name == "depth_to_color")
    recording.depth_camera->color_from_depth = depthToColor(values, where);
  else if (values.size() == 4 || values.size() == 9)
    recording.depth_camera->intrinsics = fromWords(line);
  else
    throw IOException(where + ": expected depth_intrinsics fx fy cx cy [k1 k2 p1 p2 k3]");
}

/** Takes what all lines of numbers together say: `fx fy cx cy [k1 k2 p1 p2 k3]`, or a matrix of 3x3
 *  or 4x4. */
void
takeIntrinsics(const std::vector<TextLine>& lines, const std::string& path, Recording& recording)
{
  const auto where = [&path](const TextLine& line) {
    return path + ":" + std::to_string(line.number) + ": ";
  };
  const std::vector<double> first = parseNumbers(lines[0], path);
  const std::size_t width = first.size();
  if (width == 9 || (width == 4 && first[1] != 0)) {
    if (lines.size() > 1)
      throw IOException(where(lines[1]) + "a second line of numbers; expected one line fx fy cx cy "
                                          "[k1 k2 p1 p2 k3], or a matrix");
    recording.intrinsics = fromWords(lines[0]);
    return;
  }
  const std::size_t height = width == 4 ? 4 : 3;
  if (width != height || lines.size() < height)
    throw IOException(where(lines[0]) + "expected fx fy cx cy [k1 k2 p1 p2 k3], a matrix of 3x3 or "
                                        "4x4, or depth_scale UNITS_PER_METRE");
  std::vector<double> matrix;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::vector<double> row = parseNumbers(lines[i], path);
    if (row.size() != width || i >= height)
      throw IOException(where(lines[i]) + "does not belong to the matrix above");
    matrix.insert(matrix.end(), row.begin(), row.end());
  }
  recording.intrinsics = fromMatrix(matrix, path);
}

/** Intrinsics, and lines `depth_scale`, `depth_intrinsics` and `depth_to_color`. */
void
readText(const std::string& path, Recording& recording)
{
  std::vector<TextLine> numbers;
  for (TextLine line : readTextLines(path)) {
    const std::string name = line.words[0];
    if (name == "depth_scale" || name == "depth_intrinsics" || name == "depth_to_color") {
      line.words.erase(line.words.begin());
      readNamedLine(name, line, path, recording);
    }
    else
      numbers.push_back(std::move(line));
  }
  if (!numbers.empty())
    takeIntrinsics(numbers, path, recording);
}

/** Reads a file by its extension. */
void
readFile(const std::string& path, Recording& recording)
{
  const fs::path extension = fs::path(path).extension();
  if (extension == ".json")
    readJsonCalibration(path, recording);
  else if (extension == ".txt")
    readText(path, recording);
  else
    readYamlCalibration(path, recording);
}

} // namespace

bool
readCalibrationFile(const std::string& folder, Recording& recording)
{
  for (const char* const name : {"intrinsics.txt",
                                 "intrinsic.json",
                                 "camera_intrinsic.json",
                                 "intrinsics.json",
                                 "camera_intrinsics.json",
                                 "camera.json",
                                 "camera-intrinsics.txt",
                                 "intrinsic.txt",
                                 "camera_info.yaml",
                                 "camera_info.yml",
                                 "ost.yaml",
                                 "camera.yaml",
                                 "camera.yml",
                                 "intrinsics.yaml",
                                 "intrinsics.yml",
                                 "calibration.yaml",
                                 "calibration.yml",
                                 "camera.xml",
                                 "intrinsics.xml",
                                 "calibration.xml"}) {
    const std::string path = (fs::path(folder) / name).string();
    if (!fs::exists(path))
      continue;
    recording.intrinsics_source = path;
    try {
      Recording known = recording; // all of a file counts, or nothing
      readFile(path, known);
      recording = std::move(known);
    }
    catch (const pcl::IOException& error) {
      recording.calibration_fault = messageOf(error); // does no harm where the options have all
    }
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
  const auto camera = [&](const std::string& kind, const std::string& size) {
    CameraIntrinsics result = fromMatrix(values["m_calibration" + kind + "Intrinsic"], path);
    result.width = int(number("m_" + size + "Width"));
    result.height = int(number("m_" + size + "Height"));
    return result;
  };
  const bool is_equal = number("m_colorWidth") == number("m_depthWidth");
  const bool has_color = values.count("m_calibrationColorIntrinsic") > 0;
  recording.intrinsics =
      is_equal || has_color ? camera("Color", "color") : camera("Depth", "depth");
  if (!is_equal && has_color) { // the poses of both are those of one place
    recording.depth_camera.emplace();
    recording.depth_camera->intrinsics = camera("Depth", "depth");
  }
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
