// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/calibration_files.h"

#include "io/pose_numbers.h"
#include "io/recordings/calibration_json.h"
#include "io/recordings/recorded_poses.h"
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

/** Lines "NAME = WORD..." by name, without the first two words. */
std::map<std::string, TextLine>
sensorLines(const std::string& path)
{
  std::map<std::string, TextLine> lines;
  for (TextLine line : readTextLines(path)) {
    if (line.words.size() < 3 || line.words[1] != "=")
      continue;
    const std::string name = line.words[0];
    line.words.erase(line.words.begin(), line.words.begin() + 2);
    lines[name] = std::move(line);
  }
  return lines;
}

/** What an `_info.txt` says. */
class SensorInfo {
public:
  SensorInfo(const std::map<std::string, TextLine>& lines, const std::string& path)
  : lines_(lines), path_(path)
  {
  }

  std::vector<double>
  numbers(const std::string& name) const
  {
    const auto line = lines_.find(name);
    return line == lines_.end() ? std::vector<double>() : parseNumbers(line->second, path_);
  }

  /** 0 when the file does not say it. */
  double
  number(const std::string& name) const
  {
    const std::vector<double> values = numbers(name);
    return values.size() == 1 ? values[0] : 0;
  }

  /** \param kind "Color" or "Depth"
   *  \param size "color" or "depth" */
  CameraIntrinsics
  camera(const std::string& kind, const std::string& size) const
  {
    CameraIntrinsics result = fromMatrix(numbers("m_calibration" + kind + "Intrinsic"), path_);
    result.width = side("m_" + size + "Width");
    result.height = side("m_" + size + "Height");
    return result;
  }

  /** Of a camera, 16 numbers; the identity when the file does not say it. */
  std::vector<double>
  place(const std::string& kind) const
  {
    const std::vector<double> matrix = numbers("m_calibration" + kind + "Extrinsic");
    return matrix.empty() ? std::vector<double>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}
                          : matrix;
  }

  const std::string&
  path() const
  {
    return path_;
  }

private:
  int
  side(const std::string& name) const
  {
    constexpr double largest = 1 << 15;
    const double value = number(name);
    if (!(value >= 0 && value <= largest))
      throw IOException(path_ + ": " + name + " is no size of an image");
    return int(value);
  }

  const std::map<std::string, TextLine>& lines_;
  const std::string path_;
};

void
takeSensorInfo(const SensorInfo& info, Recording& recording)
{
  // Which way the matrices map is not documented.
  if (info.place("Color") != info.place("Depth"))
    throw IOException(info.path() + ": depth is not registered to colour: their extrinsic "
                                    "matrices differ");
  const bool is_equal = info.number("m_colorWidth") == info.number("m_depthWidth");
  const bool has_color = !info.numbers("m_calibrationColorIntrinsic").empty();
  recording.intrinsics =
      is_equal || has_color ? info.camera("Color", "color") : info.camera("Depth", "depth");
  if (!is_equal && has_color) { // the poses of both are those of one place
    recording.depth_camera.emplace();
    recording.depth_camera->intrinsics = info.camera("Depth", "depth");
  }
  if (info.number("m_depthShift") > 0) {
    recording.depth_scale = info.number("m_depthShift");
    recording.depth_scale_source = info.path();
  }
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

CameraIntrinsics
readCameraMatrix(const std::string& path, std::size_t side)
{
  return fromMatrix(readNumbers(path, side * side), path);
}

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
  const std::map<std::string, TextLine> lines = sensorLines(path);
  if (lines.lower_bound("m_calibration") == lines.lower_bound("m_calibratioo"))
    return false; // notes of someone else
  recording.intrinsics_source = path;
  try {
    Recording known = recording;
    takeSensorInfo({lines, path}, known);
    recording = std::move(known);
  }
  catch (const pcl::IOException& error) {
    recording.calibration_fault = messageOf(error);
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
