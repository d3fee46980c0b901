// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/calibration_io.h>

#include "messages.h"
#include "temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <pcl/exceptions.h>

using namespace bundle_icp;
using P = CalibrationParameter;

namespace {

CameraIntrinsics
camera()
{
  CameraIntrinsics camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 525;
  camera.cx = 319.5;
  camera.cy = 239.5;
  return camera;
}

/** A file of which one thing was changed, and the reader's message. */
class CalibrationFile : public ::testing::Test {
protected:
  template <typename Change>
  std::string
  errorAfter(Change&& change)
  {
    writeCalibration(path, {}, camera());
    nlohmann::json json = nlohmann::json::parse(readText(path));
    change(json);
    writeText(path, json.dump());
    return error();
  }

  std::string
  error() const
  {
    return messageOf<pcl::IOException>([&] { readCalibration(path, camera()); });
  }

  TemporaryFolder folder;
  std::string path = folder.path("c.json");
};

} // namespace

TEST_F(CalibrationFile, GivesBackWhatWasWritten)
{
  Calibration written;
  for (int i = 0; i < NUM_CALIBRATION_PARAMETERS; ++i) {
    written.values[i] = (i % 2 ? -1 : 1) * (0.01 + i / 300.0);
    written.deviations[i] = i / 7e4;
  }
  writeCalibration(path, written, camera());
  const Calibration read = readCalibration(path, camera());
  EXPECT_EQ(read.values, written.values); // to the last bit
  EXPECT_EQ(read.deviations, written.deviations);
  EXPECT_EQ(read.depth_scale, 1);
  EXPECT_EQ(read.depth_scale_origin, DepthScaleOrigin::NOMINAL);
  written.scaleDepth(1.0123);
  writeCalibration(path, written, camera());
  EXPECT_EQ(readCalibration(path, camera()).depth_scale, 1.0123);
  EXPECT_EQ(readCalibration(path, camera()).depth_scale_origin, DepthScaleOrigin::CALIBRATION_FILE);
}

TEST_F(CalibrationFile, HoldsUnitsAndTheCamera)
{
  writeCalibration(path, {}, camera());
  const auto json = nlohmann::json::parse(readText(path));
  EXPECT_EQ(json["camera"]["width"], 640);
  EXPECT_EQ(json["camera"]["fx"], 525);
  EXPECT_EQ(json["parameters"].size(), std::size_t(NUM_CALIBRATION_PARAMETERS));
  EXPECT_EQ(json["parameters"]["readout"]["unit"], "s");
  EXPECT_EQ(json["parameters"]["depth_bias"]["unit"], "1/m");
  EXPECT_EQ(json["parameters"]["center_x"]["unit"], "px");
}

TEST_F(CalibrationFile, WhatItLacksIsZero)
{
  writeText(path, R"({"camera": {"width": 640, "height": 480, "fx": 525, "fy": 525,
                                 "cx": 319.5, "cy": 239.5},
                      "parameters": {"readout": {"value": 0.02}}})");
  const Calibration read = readCalibration(path, camera());
  EXPECT_EQ(read[P::READOUT], 0.02);
  EXPECT_EQ(read.values.cwiseAbs().sum(), 0.02);
  EXPECT_EQ(read.deviations.norm(), 0);
}

TEST_F(CalibrationFile, RefusesFilesThatAreNone)
{
  EXPECT_CONTAINS(error(), "c.json: cannot be opened: No such file");
  for (const char* const text : {"", "not JSON", "{\"camera\": ", "[1, 2]", "3"}) {
    writeText(path, text);
    EXPECT_CONTAINS(error(), "c.json: is not a JSON object");
  }
  writeText(path, "{}");
  EXPECT_CONTAINS(error(), "c.json: camera is missing");
}

TEST_F(CalibrationFile, RefusesBadParameters)
{
  EXPECT_CONTAINS(errorAfter([](auto& json) {
                    json["parameters"]["zoom"] = {{"value", 1}};
                  }),
                  "c.json: 'zoom' is not a parameter");
  EXPECT_CONTAINS(errorAfter([](auto& json) { json["parameters"]["focal_x"]["value"] = "2 %"; }),
                  "c.json: focal_x: value is not a number");
  EXPECT_CONTAINS(errorAfter([](auto& json) { json["parameters"]["focal_x"]["value"] = nullptr; }),
                  "c.json: focal_x: value is not a number");
  EXPECT_CONTAINS(errorAfter([](auto& json) { json["parameters"]["focal_x"] = 0.1; }),
                  "c.json: focal_x: value is missing");
  EXPECT_CONTAINS(errorAfter([](auto& json) { json["parameters"]["focal_x"]["deviation"] = "x"; }),
                  "c.json: focal_x: deviation is not a number");
  EXPECT_CONTAINS(errorAfter([](auto& json) { json["parameters"]["focal_x"]["value"] = 0.5; }),
                  "c.json: focal_x must lie within +-0.2");
  EXPECT_CONTAINS(errorAfter([](auto& json) { json["depth_scale"] = 3; }),
                  "c.json: depth_scale must lie in (0.5, 2)");
  EXPECT_CONTAINS(errorAfter([](auto& json) { json["depth_scale"] = "one"; }),
                  "c.json: depth_scale is not a number");
  EXPECT_CONTAINS(errorAfter([](auto& json) { json.erase("parameters"); }),
                  "c.json: parameters are missing");
}

TEST_F(CalibrationFile, RefusesAnotherCamera)
{
  EXPECT_CONTAINS(errorAfter([](auto& json) { json["camera"]["width"] = 320; }),
                  "c.json: made for images of 320x480, not 640x480");
  EXPECT_CONTAINS(errorAfter([](auto& json) { json["camera"]["fx"] = 535.4; }),
                  "c.json: made for a camera of fx 535.4, not 525");
  EXPECT_CONTAINS(errorAfter([](auto& json) { json["camera"]["fx"] = 525.0012; }),
                  "c.json: made for a camera of fx 525.0012, not 525");
  EXPECT_CONTAINS(errorAfter([](auto& json) { json["camera"].erase("height"); }),
                  "c.json: camera: height is missing");
}

TEST_F(CalibrationFile, NamesThePlaceThatCannotBeWritten)
{
  EXPECT_CONTAINS(messageOf<pcl::IOException>(
                      [&] { writeCalibration(folder.path("absent/c.json"), {}, camera()); }),
                  "absent/c.json");
}

TEST_F(CalibrationFile, DepthNoiseComesFromANameOrAFile)
{
  EXPECT_EQ(sensorName(readDepthNoise("tof")), "tof");
  const auto failure = [&](const char* text) {
    writeText(path, text);
    return messageOf<pcl::IOException>([&] { readDepthNoise(path); });
  };
  writeText(path, R"({"constant": 0.002, "quadratic": 0.001, "offset": 0.5})");
  EXPECT_NEAR(readDepthNoise(path).sigma(1.5), 0.003, 1e-15);
  EXPECT_CONTAINS(failure("[1]"), "c.json: is not a JSON object");
  EXPECT_CONTAINS(failure(R"({"constant": 0.002, "offset": 0})"), "c.json: quadratic is missing");
  EXPECT_CONTAINS(failure(R"({"constant": 0, "quadratic": 0, "offset": 0})"),
                  "c.json: depth noise needs a finite constant > 0 m");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([] { readDepthNoise("Kinect"); }),
                  "Kinect: no such file, and no sensor of that name; known are kinect, d400");
}
