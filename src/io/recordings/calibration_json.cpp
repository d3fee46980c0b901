// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/calibration_json.h"

#include "io/pose_numbers.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/algorithm/string.hpp>
#include <nlohmann/json.hpp>

#include <cmath>
#include <initializer_list>

namespace bundle_icp {

namespace {

using Json = nlohmann::json;
using Names = std::initializer_list<const char*>;

/** The value of the first of these keys that is there; null when there is none. */
const Json&
valueOf(const Json& json, Names names)
{
  static const Json none;
  if (json.is_object())
    for (const char* const name : names)
      if (const auto found = json.find(name); found != json.end())
        return *found;
  return none;
}

/** The first of these keys whose value is an object; null when there is none. */
const Json&
partOf(const Json& json, Names names)
{
  static const Json none;
  for (const char* const name : names)
    if (const Json& part = valueOf(json, {name}); part.is_object())
      return part;
  return none;
}

void
addNumbers(const Json& json, const std::string& where, std::vector<double>& numbers)
{
  if (json.is_array())
    for (const Json& element : json)
      addNumbers(element, where, numbers);
  else if (json.is_number() && std::isfinite(json.get<double>()))
    numbers.push_back(json.get<double>());
  else
    throw IOException(where + " must be a number, or a list of numbers");
}

/** A number, or the numbers of a list, of lists, or of a matrix {rows, cols, data}, row by row. */
std::vector<double>
numbersOf(const Json& json, const std::string& where)
{
  std::vector<double> numbers;
  const Json& data = valueOf(json, {"data"});
  addNumbers(data.is_null() ? json : data, where, numbers);
  return numbers;
}

double
numberOf(const Json& json, Names names, const std::string& path)
{
  const std::string where = path + ": " + *names.begin();
  const Json& value = valueOf(json, names);
  if (value.is_null())
    throw IOException(where + " is missing");
  const std::vector<double> numbers = numbersOf(value, where);
  if (numbers.size() != 1)
    throw IOException(where + " must be one number");
  return numbers[0];
}

int
pixelsOf(const Json& json, Names names, const std::string& path)
{
  const double number = numberOf(json, names, path);
  if (!(number >= 0 && number < 1e6))
    throw IOException(path + ": " + *names.begin() + " is no size of an image");
  return int(number);
}

bool
isNested(const Json& json)
{
  return json.is_array() && !json.empty() && json[0].is_array();
}

/** \param numbers 9, row by row */
CameraIntrinsics
fromRows(const std::vector<double>& numbers, const std::string& where, const char* expected)
{
  if (numbers.size() != 9 || numbers[1] != 0 || numbers[3] != 0 || numbers[6] != 0 ||
      numbers[7] != 0 || numbers[8] != 1)
    throw IOException(where + " must be " + expected);
  CameraIntrinsics camera;
  camera.fx = numbers[0];
  camera.fy = numbers[4];
  camera.cx = numbers[2];
  camera.cy = numbers[5];
  return camera;
}

/** Open3D's `intrinsic_matrix`: 9 numbers column by column, or three rows. */
CameraIntrinsics
fromIntrinsicMatrix(const Json& json, const std::string& path)
{
  const std::string where = path + ": intrinsic_matrix";
  std::vector<double> m = numbersOf(json, where);
  if (isNested(json))
    return fromRows(m, where, "a matrix of 3x3: fx 0 cx, 0 fy cy, 0 0 1");
  if (m.size() == 9)
    m = {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]};
  return fromRows(m, where, "9 numbers, column by column: fx 0 0 0 fy 0 cx cy 1");
}

bool
isZero(const std::vector<double>& numbers, std::size_t first = 0)
{
  return std::all_of(numbers.begin() + std::ptrdiff_t(std::min(first, numbers.size())),
                     numbers.end(), [](double x) { return x == 0; });
}

/** Refuses a lens that is not that of OpenCV's five parameters. */
void
checkModel(const std::string& model, const std::string& path)
{
  std::string name = boost::to_lower_copy(model);
  boost::replace_all(name, " ", "_");
  for (const char* const known : {"brown_conrady", "plumb_bob", "radtan", "none"})
    if (boost::ends_with(name, known) && !boost::ends_with(name, "inverse_brown_conrady") &&
        !boost::ends_with(name, "modified_brown_conrady"))
      return;
  throw IOException(path + ": the distortion model '" + model +
                    "' is not known; undistort the images, or give the lens as k1, k2, p1, "
                    "p2, k3 of OpenCV with --intrinsics");
}

/** k1, k2, p1, p2, k3 of a list, or of keys of these names; a lens of zeros has no model. */
std::vector<double>
distortionOf(const Json& json, const std::string& path)
{
  std::vector<double> lens;
  const Json& list = valueOf(json, {"coeffs", "distortion_coefficients", "distCoeffs",
                                    "dist_coeffs", "distortion_coeffs", "D", "d"});
  if (!list.is_null())
    lens = numbersOf(list, path + ": the list of distortion coefficients");
  else
    for (const char* const name : {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"})
      lens.push_back(valueOf(json, {name}).is_null() ? 0 : numberOf(json, {name}, path));
  const Json& model = valueOf(json, {"model", "distortion_model"});
  if (!isZero(lens) && model.is_string())
    checkModel(model.get<std::string>(), path);
  else if (!isZero(lens) && json.contains("coeffs"))
    throw IOException(path + ": coeffs without the name of their model");
  if (!isZero(lens, 5))
    throw IOException(path + ": a lens of more than k1, k2, p1, p2, k3 is not known; "
                             "undistort the images first");
  lens.resize(5, 0.0);
  return lens;
}

/** Intrinsics of an object, size 0 where it has none; nothing when no known key is there. */
std::optional<CameraIntrinsics>
intrinsicsOf(const Json& json, const std::string& path)
{
  const Json& inner = partOf(json, {"intrinsic", "intrinsics"});
  if (inner.is_object())
    return intrinsicsOf(inner, path);
  CameraIntrinsics camera;
  const Json& open3d = valueOf(json, {"intrinsic_matrix"});
  const Json& rows = valueOf(json, {"camera_matrix", "cameraMatrix", "K", "k"});
  if (!open3d.is_null())
    camera = fromIntrinsicMatrix(open3d, path);
  else if (!rows.is_null())
    camera = fromRows(numbersOf(rows, path + ": the camera matrix"), path + ": the camera matrix",
                      "fx 0 cx, 0 fy cy, 0 0 1, row by row");
  else if (!valueOf(json, {"fx"}).is_null()) {
    camera.fx = numberOf(json, {"fx"}, path);
    camera.fy = numberOf(json, {"fy"}, path);
    camera.cx = numberOf(json, {"cx", "ppx"}, path);
    camera.cy = numberOf(json, {"cy", "ppy"}, path);
  }
  else
    return std::nullopt;
  const std::vector<double> lens = distortionOf(json, path);
  camera.k1 = lens[0];
  camera.k2 = lens[1];
  camera.p1 = lens[2];
  camera.p2 = lens[3];
  camera.k3 = lens[4];
  if (!valueOf(json, {"width", "image_width"}).is_null()) {
    camera.width = pixelsOf(json, {"width", "image_width"}, path);
    camera.height = pixelsOf(json, {"height", "image_height"}, path);
  }
  return camera;
}

/** A matrix by rows, 16 numbers in either order, or librealsense's {rotation, translation}, whose
 *  rotation has 9 numbers column by column. */
Pose
poseOf(const Json& json, const std::string& where)
{
  std::vector<double> m;
  if (!json.is_object())
    m = numbersOf(json, where);
  else {
    const Json& rotation = valueOf(json, {"rotation"});
    const std::vector<double> r = numbersOf(rotation, where + ".rotation");
    const std::vector<double> t = numbersOf(valueOf(json, {"translation"}), where + ".translation");
    if (r.size() != 9 || t.size() != 3)
      throw IOException(where + " must have a rotation of 9 numbers and a translation of 3");
    m = isNested(rotation) ? std::vector<double>{r[0], r[1], r[2], t[0], r[3], r[4],
                                                 r[5], t[1], r[6], r[7], r[8], t[2]}
                           : std::vector<double>{r[0], r[3], r[6], t[0], r[1], r[4],
                                                 r[7], t[1], r[2], r[5], r[8], t[2]};
  }
  const bool are_columns = m.size() == 16 && !isNested(json) && m[3] == 0 && m[7] == 0 &&
                           m[11] == 0 && (m[12] != 0 || m[13] != 0 || m[14] != 0);
  if (are_columns)
    m = {m[0], m[4], m[8],  m[12], m[1], m[5], m[9],  m[13],
         m[2], m[6], m[10], m[14], m[3], m[7], m[11], m[15]};
  return depthToColor(m, where);
}

void
takeDepthCamera(const Json& json, const std::string& path, Recording& recording)
{
  const Json& part = partOf(json, {"depth", "depth_intrinsics", "depth_camera"});
  const Json& place = valueOf(json, {"depth_to_color"});
  if (part.is_null() && place.is_null())
    return;
  DepthCamera depth;
  depth.intrinsics = intrinsicsOf(part, path).value_or(CameraIntrinsics());
  if (!place.is_null())
    depth.color_from_depth = poseOf(place, path + ": depth_to_color");
  if (depth.intrinsics.fx != 0 || !place.is_null())
    recording.depth_camera = depth;
}

/** librealsense writes metres per unit, Open3D units per metre. */
void
takeDepthScale(const Json& json, const std::string& path, Recording& recording)
{
  const Json& depth = partOf(json, {"depth"});
  const Json& part = valueOf(json, {"depth_scale"}).is_null() ? depth : json;
  if (valueOf(part, {"depth_scale"}).is_null())
    return;
  const double scale = numberOf(part, {"depth_scale"}, path);
  if (!(scale > 0))
    throw IOException(path + ": depth_scale must be positive");
  recording.depth_scale = scale < 1 ? 1 / scale : scale;
  recording.depth_scale_source = path;
}

/** The keys of an object, for messages. */
std::string
keysOf(const Json& json)
{
  std::string keys;
  if (json.is_object())
    for (const auto& [key, value] : json.items())
      keys += (keys.empty() ? "" : ", ") + key.substr(0, 40);
  return keys.empty() ? "no key" : keys.substr(0, 300);
}

} // namespace

void
takeCalibration(const Json& json, const std::string& path, Recording& recording)
{
  const Json& color = partOf(json, {"color", "rgb", "color_intrinsics", "color_camera"});
  const std::optional<CameraIntrinsics> camera = intrinsicsOf(color.is_null() ? json : color, path);
  if (!camera)
    throw IOException(path +
                      ": holds no intrinsics of a known form: looked for "
                      "intrinsic_matrix, camera_matrix (cameraMatrix, K) or fx, fy, "
                      "cx, cy (ppx, ppy), also below intrinsic and color; found " +
                      keysOf(json));
  recording.intrinsics = camera;
  takeDepthCamera(json, path, recording);
  takeDepthScale(json, path, recording);
}

void
readJsonCalibration(const std::string& path, Recording& recording)
{
  const Json json = Json::parse(toUtf8(readBytes(path)), nullptr, false);
  if (json.is_discarded())
    throw IOException(path + ": is not JSON");
  takeCalibration(json, path, recording);
}

} // namespace bundle_icp
