// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Calibration files as Open3D, librealsense, OpenCV and ROS write them.
#include "io/recordings/calibration_files.h"

#include "messages.h"
#include "temporary_folder.h"

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <locale>

using namespace bundle_icp;

namespace {

class CalibrationFiles : public ::testing::Test {
protected:
  /** What the only file of a folder says. */
  static Recording
  read(const std::string& name, const std::string& text)
  {
    const TemporaryFolder folder;
    writeText(folder.path(name), text);
    Recording recording;
    recording.depth_scale = 1000;
    EXPECT_TRUE(readCalibrationFile(folder.path(), recording)) << name;
    EXPECT_CONTAINS(recording.intrinsics_source, name);
    return recording;
  }

  static Recording
  readGood(const std::string& name, const std::string& text)
  {
    const Recording recording = read(name, text);
    EXPECT_EQ(recording.calibration_fault, "") << text;
    return recording;
  }

  static std::string
  fault(const std::string& name, const std::string& text)
  {
    const Recording recording = read(name, text);
    EXPECT_FALSE(recording.intrinsics) << text;
    EXPECT_CONTAINS(recording.calibration_fault, name);
    for (const char* const foreign : {"json.exception", "OpenCV(", "parse_error", ".cpp"})
      EXPECT_EQ(recording.calibration_fault.find(foreign), std::string::npos)
          << recording.calibration_fault;
    return recording.calibration_fault;
  }
};

void
expectCamera(const Recording& recording)
{
  ASSERT_TRUE(recording.intrinsics);
  EXPECT_EQ(recording.intrinsics->fx, 600.5);
  EXPECT_EQ(recording.intrinsics->fy, 601);
  EXPECT_EQ(recording.intrinsics->cx, 320.25);
  EXPECT_EQ(recording.intrinsics->cy, 240);
}

void
expectLens(const Recording& recording)
{
  ASSERT_TRUE(recording.intrinsics);
  EXPECT_EQ(recording.intrinsics->k1, 0.1);
  EXPECT_EQ(recording.intrinsics->k2, -0.2);
  EXPECT_EQ(recording.intrinsics->p1, 0.001);
  EXPECT_EQ(recording.intrinsics->p2, 0.002);
  EXPECT_EQ(recording.intrinsics->k3, 0.03);
}

const std::string columns = R"("intrinsic_matrix": [600.5, 0, 0, 0, 601, 0, 320.25, 240, 1])";
const std::string realsense = R"("fx": 600.5, "fy": 601, "ppx": 320.25, "ppy": 240)";
const std::string lens = "[0.1, -0.2, 0.001, 0.002, 0.03]";

} // namespace

TEST_F(CalibrationFiles, JsonOfOpen3d)
{
  const Recording plain =
      readGood("intrinsic.json", "{\"width\": 640, \"height\": 480, " + columns + "}");
  expectCamera(plain);
  EXPECT_EQ(plain.intrinsics->width, 640);
  EXPECT_EQ(plain.intrinsics->height, 480);
  EXPECT_EQ(plain.depth_scale, 1000);
  EXPECT_FALSE(plain.depth_camera);
  const Recording parameters = readGood("camera.json", R"({"class_name": "PinholeCameraParameters",
                "extrinsic": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
                "intrinsic": {"width": 640, "height": 480, )" +
                                                           columns + "}}");
  expectCamera(parameters);
  EXPECT_EQ(parameters.intrinsics->width, 640);
  expectCamera(readGood("intrinsic.json", R"({"color_mode": "MJPG_720P", "depth_mode": "NFOV",
                "serial_number_": "0", "stream_length_usec": 2666689, )" +
                                              columns + "}"));
  expectCamera(readGood("intrinsic.json",
                        R"({"intrinsic_matrix": [[600.5, 0, 320.25], [0, 601, 240], [0, 0, 1]]})"));
}

TEST_F(CalibrationFiles, JsonOfRealsense)
{
  const Recording plain =
      readGood("intrinsics.json", "{" + realsense + R"(, "model": "brown_conrady", "coeffs": )" +
                                      lens + R"(, "depth_scale": 0.00025})");
  expectCamera(plain);
  expectLens(plain);
  EXPECT_DOUBLE_EQ(plain.depth_scale, 4000);
  for (const char* const model :
       {"Brown Conrady", "distortion.brown_conrady", "RS2_DISTORTION_BROWN_CONRADY"})
    expectLens(readGood("intrinsic.json", "{" + realsense + R"(, "model": ")" + model +
                                              R"(", "coeffs": )" + lens + "}"));
  for (const char* const model : {"inverse_brown_conrady", "Inverse Brown Conrady", "ftheta",
                                  "kannala_brandt4", "modified_brown_conrady"})
    EXPECT_CONTAINS(fault("intrinsic.json", "{" + realsense + R"(, "model": ")" + model +
                                                R"(", "coeffs": )" + lens + "}"),
                    std::string("'") + model + "' is not known");
  // A lens of zeros is none, whatever its model.
  expectCamera(readGood("intrinsic.json",
                        "{" + realsense +
                            R"(, "model": "inverse_brown_conrady", "coeffs": [0, 0, 0, 0, 0]})"));
  EXPECT_CONTAINS(fault("intrinsic.json", "{" + realsense + R"(, "coeffs": )" + lens + "}"),
                  "coeffs without the name of their model");
}

TEST_F(CalibrationFiles, DepthScaleInEitherUnit)
{
  for (const auto& [text, units] :
       {std::pair<const char*, double>{"1000", 1000}, {"5000.0", 5000}, {"0.001", 1000}}) {
    const Recording recording =
        readGood("intrinsic.json", "{" + columns + R"(, "depth_scale": )" + text + "}");
    EXPECT_DOUBLE_EQ(recording.depth_scale, units);
    EXPECT_CONTAINS(recording.depth_scale_source, "intrinsic.json");
  }
  EXPECT_CONTAINS(fault("intrinsic.json", "{" + columns + R"(, "depth_scale": 0})"),
                  "depth_scale must be positive");
}

TEST_F(CalibrationFiles, TwoCameras)
{
  const std::string color = R"("color": {"width": 640, "height": 480, )" + realsense + "}";
  const std::string depth = R"("depth": {"width": 848, "height": 480, "fx": 420, "fy": 421,
                                "ppx": 424, "ppy": 238, "depth_scale": 0.001})";
  const std::string start = "{" + color + ", " + depth;
  // 0.1 rad around x; column-major, as librealsense has it.
  const std::string place = R"({"rotation": [1, 0, 0, 0, 0.9950041653, 0.0998334166, 0,
                                -0.0998334166, 0.9950041653], "translation": [0.015, 0, 0.001]})";
  const std::string rows = "[[1, 0, 0, 0.015], [0, 0.9950041653, -0.0998334166, 0], "
                           "[0, 0.0998334166, 0.9950041653, 0.001], [0, 0, 0, 1]]";
  const std::string flat = "[1, 0, 0, 0.015, 0, 0.9950041653, -0.0998334166, 0, "
                           "0, 0.0998334166, 0.9950041653, 0.001, 0, 0, 0, 1]";
  const std::string by_columns = "[1, 0, 0, 0, 0, 0.9950041653, 0.0998334166, 0, "
                                 "0, -0.0998334166, 0.9950041653, 0, 0.015, 0, 0.001, 1]";
  for (const std::string& text : {place, rows, flat, by_columns}) {
    const Recording recording =
        readGood("camera.json", start + R"(, "depth_to_color": )" + text + "}");
    expectCamera(recording);
    EXPECT_DOUBLE_EQ(recording.depth_scale, 1000);
    ASSERT_TRUE(recording.depth_camera);
    EXPECT_EQ(recording.depth_camera->intrinsics.fy, 421);
    EXPECT_EQ(recording.depth_camera->intrinsics.width, 848);
    const Pose& pose = recording.depth_camera->color_from_depth;
    EXPECT_NEAR(pose(2, 1), std::sin(0.1), 1e-8) << text;
    EXPECT_TRUE(pose.translation().isApprox(Eigen::Vector3d(0.015, 0, 0.001), 1e-12)) << text;
  }
  const Recording same_place = readGood("camera.json", start + "}");
  ASSERT_TRUE(same_place.depth_camera);
  EXPECT_TRUE(same_place.depth_camera->color_from_depth.matrix().isIdentity(0));
  EXPECT_CONTAINS(fault("camera.json", start + R"(, "depth_to_color": [1, 2]})"),
                  "depth_to_color: 2 numbers");
}

TEST_F(CalibrationFiles, Utf16AndByteOrderMarks)
{
  const std::string text = "{" + columns + "}";
  std::string little = "\xff\xfe", big = "\xfe\xff";
  for (const char letter : text) {
    little += {letter, '\0'};
    big += {'\0', letter};
  }
  for (const std::string& bytes : {"\xef\xbb\xbf" + text, little, big})
    expectCamera(readGood("intrinsic.json", bytes));
  expectCamera(readGood("intrinsics.txt", "\xef\xbb\xbf"
                                          "600.5 601 320.25 240\n"));
}

TEST_F(CalibrationFiles, TextOfNumbers)
{
  expectLens(readGood("intrinsics.txt", "600.5 601 320.25 240 0.1 -0.2 0.001 0.002 0.03\n"));
  expectCamera(readGood("intrinsics.txt", "# fx 0 cx\n600.5 0 320.25\n0 601 240\n0 0 1\n"));
  expectCamera(readGood("intrinsic.txt",
                        "600.5 0 320.25 0\ndepth_scale 5000\n0 601 240 0\n0 0 1 0\n0 0 0 1\n"));
  const auto expect = [](const std::string& text, const std::string& part) {
    EXPECT_CONTAINS(fault("intrinsics.txt", text), part);
  };
  const std::string line = "600.5 601 320.25 240\n", matrix = "600 0 320\n0 601 240\n0 0 1\n";
  expect(line + line, "intrinsics.txt:2: a second line of numbers");
  expect(line + "depth_scale 1000\n\n500 500 320 240 0 0 0 0 0\n", "intrinsics.txt:4: a second");
  expect(line + matrix, "intrinsics.txt:2: a second line of numbers");
  expect(matrix + line, "intrinsics.txt:4: does not belong to the matrix above");
  expect(matrix + matrix, "intrinsics.txt:4: does not belong to the matrix above");
  expect("600 0 320\n" + line + matrix, "intrinsics.txt:2: does not belong to the matrix above");
  expect("600 0 320\n0 601 240\n", "intrinsics.txt:1: expected fx fy cx cy");
  expect("600 601 320 240 7\n", "intrinsics.txt:1: expected fx fy cx cy");
  expect("600 0 320\n0 601 240\n0 0 2\n", "expected a matrix fx 0 cx, 0 fy cy, 0 0 1");
}

TEST_F(CalibrationFiles, YamlOfRos)
{
  const std::string calibrator = "image_width: 640\nimage_height: 480\ncamera_name: rgb\n"
                                 "camera_matrix:\n  rows: 3\n  cols: 3\n"
                                 "  data: [600.5, 0.0, 320.25, 0, 601, 240, 0, 0, 1]\n"
                                 "distortion_model: plumb_bob\ndistortion_coefficients:\n"
                                 "  rows: 1\n  cols: 5\n  data: [0.1, -0.2, 0.001, 0.002, 0.03]\n";
  for (const std::string name : {"camera_info.yaml", "ost.yaml", "calibration.yml"}) {
    const Recording recording = readGood(name, calibrator);
    expectCamera(recording);
    expectLens(recording);
    EXPECT_EQ(recording.intrinsics->height, 480);
  }
  const std::string message =
      "height: 480\nwidth: 640\ndistortion_model: \"plumb_bob\"\nD: " + lens +
      "\nK: [600.5, 0.0, 320.25, 0.0, 601.0, 240.0, 0.0, 0.0, 1.0]\n---\n";
  const Recording echo = readGood("camera_info.yaml", message);
  expectCamera(echo);
  expectLens(echo);
  std::string lines = "K:\n";
  for (const char* const number : {"600.5", "0", "320.25", "0", "601.", "240", "0", "0", "1"})
    lines += std::string("- ") + number + "\n";
  expectCamera(readGood("camera_info.yaml", "height: 480  # px\n" + lines));
  expectCamera(readGood("camera_info.yaml", "# by hand\n" + lines + "D: [0, 0,\n    0, 0, 0]\n"));
  std::string fisheye = calibrator;
  fisheye.replace(fisheye.find("plumb_bob"), 9, "equidistant");
  EXPECT_CONTAINS(fault("camera_info.yaml", fisheye), "'equidistant' is not known");
}

TEST_F(CalibrationFiles, YamlAndXmlOfOpencv)
{
  const std::string yaml =
      "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
      "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
      "   data: [ 6.0050000000000000e+02, 0., 320.25, 0., 601., 240., 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n"
      "   data: [ 0.1, -0.2, 0.001, 0.002, 0.03 ]\n";
  const Recording by_yaml = readGood("calibration.yaml", yaml);
  expectCamera(by_yaml);
  expectLens(by_yaml);
  EXPECT_EQ(by_yaml.intrinsics->width, 640);
  const Recording by_xml = readGood(
      "calibration.xml",
      "<?xml version=\"1.0\"?>\n<opencv_storage>\n<cameraMatrix type_id=\"opencv-matrix\">\n"
      "<rows>3</rows><cols>3</cols><dt>d</dt>\n<data>600.5 0. 320.25 0. 601. 240. 0. 0. 1.</data>"
      "</cameraMatrix>\n<distortion_coefficients type_id=\"opencv-matrix\">\n"
      "<rows>1</rows><cols>5</cols><dt>d</dt>\n<data>0.1 -0.2 0.001 0.002 0.03</data>"
      "</distortion_coefficients>\n</opencv_storage>\n");
  expectCamera(by_xml);
  expectLens(by_xml);
}

TEST_F(CalibrationFiles, UnknownFormsNameTheFileAndTheKeys)
{
  EXPECT_CONTAINS(fault("intrinsic.json", R"({"focal": 525, "center": [320, 240]})"),
                  "looked for intrinsic_matrix");
  EXPECT_CONTAINS(fault("intrinsic.json", R"({"focal": 525, "center": [320, 240]})"),
                  "found center, focal");
  EXPECT_CONTAINS(fault("intrinsic.json", "[1, 2]"), "found no key");
  EXPECT_CONTAINS(fault("intrinsic.json", "{\"fx\": 600"), "is not JSON");
  EXPECT_CONTAINS(fault("intrinsic.json", R"({"fx": "600", "fy": 600, "cx": 1, "cy": 1})"),
                  "fx must be a number");
  EXPECT_CONTAINS(fault("intrinsic.json", R"({"fx": 600, "fy": 600, "cx": 1})"), "cy is missing");
  EXPECT_CONTAINS(fault("intrinsic.json", R"({"intrinsic_matrix": [600, 0, 320]})"),
                  "9 numbers, column by column");
  EXPECT_CONTAINS(fault("camera.yaml", "a: 1\nb"), "is neither YAML nor XML");
  EXPECT_CONTAINS(fault("camera.yaml", "K: [1, 2\nb"), "the camera matrix");
  EXPECT_CONTAINS(fault("camera.yaml", "a: 1\nb: 2\n"), "found a, b");
  for (const char* const damaged : {"<opencv_storage><a>", "<?xml version=", "<"})
    EXPECT_CONTAINS(fault("camera.xml", damaged), "is neither YAML nor XML");
  EXPECT_CONTAINS(fault("camera.yaml", ""), "camera.yaml");
}

TEST_F(CalibrationFiles, DoNotDependOnTheLocale)
{
  struct Comma : std::numpunct<char> {
    char
    do_decimal_point() const override
    {
      return ',';
    }
  };
  const std::locale old = std::locale::global(std::locale(std::locale::classic(), new Comma));
  // The C library's locale, where the machine has one with a comma.
  const std::string old_c = std::setlocale(LC_NUMERIC, nullptr);
  for (const char* const name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8"})
    if (std::setlocale(LC_NUMERIC, name))
      break;
  expectLens(readGood("intrinsic.json", "{" + realsense + R"(, "model": "brown_conrady",
                      "coeffs": )" + lens + "}"));
  expectCamera(readGood("intrinsics.txt", "600.5 601 320.25 240\n"));
  expectLens(readGood("camera.yaml", "K: [600.5, 0, 320.25, 0, 601, 240, 0, 0, 1]\nD: " + lens));
  std::setlocale(LC_NUMERIC, old_c.c_str());
  std::locale::global(old);
}
