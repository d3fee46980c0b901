// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/calibration_io.h>

#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/io/atomic_file.h>

#include <boost/filesystem.hpp>
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>

namespace bundle_icp {
namespace {

using Json = nlohmann::ordered_json;

/** Number `key` of an object.
 *  \param name what it is called in messages */
double
numberIn(const Json& object, const char* key, const std::string& name)
{
  if (!object.is_object() || !object.contains(key))
    throw IOException(name + " is missing");
  if (!object[key].is_number() || !std::isfinite(object[key].get<double>()))
    throw IOException(name + " is not a number");
  return object[key];
}

/** With digits enough to tell two cameras apart. */
std::string
toText(double value)
{
  return shortText(value, 9);
}

/** Corrections are relative to a camera: on top of another they would be wrong. */
void
requireCamera(const Json& json, const CameraIntrinsics& camera)
{
  const double width = numberIn(json, "width", "camera: width");
  const double height = numberIn(json, "height", "camera: height");
  if (width != camera.width || height != camera.height)
    throw IOException("made for images of " + toText(width) + "x" + toText(height) + ", not " +
                      std::to_string(camera.width) + "x" + std::to_string(camera.height));
  const std::pair<const char*, double> expected[] = {
      {"fx", camera.fx}, {"fy", camera.fy}, {"cx", camera.cx}, {"cy", camera.cy}};
  for (const auto& [name, value] : expected) {
    const double found = numberIn(json, name, std::string("camera: ") + name);
    if (std::abs(found - value) > 1e-3)
      throw IOException(std::string("made for a camera of ") + name + " " + toText(found) +
                        ", not " + toText(value));
  }
}

void
readParameter(const std::string& name, const Json& json, Calibration& calibration)
{
  for (int i = 0; i < NUM_CALIBRATION_PARAMETERS; ++i)
    if (name == calibrationName(CalibrationParameter(i))) {
      calibration.values[i] = numberIn(json, "value", name + ": value");
      if (json.contains("deviation"))
        calibration.deviations[i] = numberIn(json, "deviation", name + ": deviation");
      return;
    }
  throw IOException("'" + name + "' is not a parameter");
}

Calibration
parse(const std::string& text, const CameraIntrinsics& camera)
{
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object())
    throw IOException("is not a JSON object");
  if (!json.contains("camera"))
    throw IOException("camera is missing");
  requireCamera(json["camera"], camera);
  Calibration calibration;
  if (json.contains("depth_scale"))
    calibration.depth_scale = numberIn(json, "depth_scale", "depth_scale");
  if (calibration.depth_scale != 1)
    calibration.depth_scale_origin = DepthScaleOrigin::CALIBRATION_FILE;
  if (!json.contains("parameters") || !json["parameters"].is_object())
    throw IOException("parameters are missing");
  for (const auto& [name, parameter] : json["parameters"].items())
    readParameter(name, parameter, calibration);
  std::string error;
  if (!calibration.isValid(&error))
    throw IOException(error);
  return calibration;
}

} // namespace

void
writeCalibration(const std::string& path, const Calibration& calibration,
                 const CameraIntrinsics& camera)
{
  Json json{{"camera",
             {{"width", camera.width},
              {"height", camera.height},
              {"fx", camera.fx},
              {"fy", camera.fy},
              {"cx", camera.cx},
              {"cy", camera.cy}}},
            {"depth_scale", calibration.depth_scale}};
  for (int i = 0; i < NUM_CALIBRATION_PARAMETERS; ++i) {
    const auto parameter = CalibrationParameter(i);
    json["parameters"][calibrationName(parameter)] = {{"value", calibration.values[i]},
                                                      {"deviation", calibration.deviations[i]},
                                                      {"unit", calibrationUnit(parameter)}};
  }
  writeAtomically(path, [&](const std::string& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    file << json.dump(2) << "\n";
    if (!file.flush())
      throw IOException(path + ": cannot be written, is the disk full?");
  });
}

Calibration
readCalibration(const std::string& path, const CameraIntrinsics& camera)
{
  const std::string text = readBytes(path);
  try {
    return parse(text, camera);
  }
  catch (const pcl::IOException& error) {
    throw IOException(path + ": " + messageOf(error));
  }
}

DepthNoise
readDepthNoise(const std::string& sensor)
{
  if (const std::optional<DepthNoise> known = depthNoiseOf(sensor))
    return *known;
  if (!boost::filesystem::exists(sensor))
    throw IOException(sensor + ": no such file, and no sensor of that name; known are kinect, "
                               "d400, tof and lidar");
  const Json json = Json::parse(readBytes(sensor), nullptr, false);
  std::string error = "is not a JSON object";
  if (json.is_object())
    try {
      const DepthNoise noise{numberIn(json, "constant", "constant"),
                             numberIn(json, "quadratic", "quadratic"),
                             numberIn(json, "offset", "offset")};
      if (noise.isValid(&error))
        return noise;
    }
    catch (const pcl::IOException& fault) {
      error = messageOf(fault);
    }
  throw IOException(sensor + ": " + error);
}

} // namespace bundle_icp
