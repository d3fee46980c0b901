// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "changes.h"
#include "inputs.h"
#include "temporary_folder.h"

#include <cmath>

namespace adversity {
namespace {

using Change = std::function<void(Recording&)>;

const char* const UNITS = "wrong unit|no room|unit of depth is|hardly any depth|has depth";
/** Numbers that are no depth at all. */
const char* const NO_DEPTH =
    "wrong unit|no room|no depth|not depth|inverse|disparity|display|noise";
const char* const LENS = "focal length|half the size|twice the size|principal point|field of view|"
                         "pixels are square|intrinsics .*are for";

/** Depth in other units, which nothing says. */
Change
units(const std::function<double(double metres)>& rule)
{
  return [=](Recording& r) { changeDepth(r, rule); };
}

/** As units(), in Open3D's layout, where millimetres are meant. */
Change
open3dUnits(const std::function<double(double metres)>& rule)
{
  return [=](Recording& r) {
    changeDepth(r, rule);
    r.layout = Layout::OPEN3D;
    r.depth_scale = 1000;
  };
}

cv::Mat
withSwappedBytes(const cv::Mat& pixels)
{
  cv::Mat result = pixels.clone();
  result.forEach<ushort>(
      [](ushort& value, const int*) { value = ushort((value << 8) | (value >> 8)); });
  return result;
}

/** Each image in 256 steps from its least to its greatest depth, as for a picture of it. */
cv::Mat
stretched(const cv::Mat& pixels)
{
  cv::Mat result;
  cv::normalize(pixels, result, 0, 65535, cv::NORM_MINMAX, CV_16U, pixels != 0);
  result.setTo(0, pixels == 0);
  return result;
}

cv::Mat
withWildPixels(std::size_t index, const cv::Mat& pixels)
{
  cv::Mat result = pixels.clone();
  cv::RNG random(index + 1);
  for (int k = 0; k < int(pixels.total() / 33); ++k)
    result.at<ushort>(random.uniform(0, pixels.rows), random.uniform(0, pixels.cols)) =
        ushort(random.uniform(1, 65535));
  return result;
}

/** The length of the ray in place of the depth along the axis. */
void
rayLengths(Recording& r)
{
  const auto camera = r.camera;
  changePixels(r.depth, [camera](std::size_t, const cv::Mat& pixels) {
    cv::Mat result = pixels.clone();
    for (int y = 0; y < result.rows; ++y)
      for (int x = 0; x < result.cols; ++x)
        result.at<ushort>(y, x) =
            cv::saturate_cast<ushort>(result.at<ushort>(y, x) * camera.unproject(x, y, 1).norm());
    return result;
  });
}

/** Multiplies fx and fy, cx and cy. */
Change
lens(double focal, double center = 1)
{
  return [=](Recording& r) {
    r.camera.fx *= focal;
    r.camera.fy *= focal;
    r.camera.cx *= center;
    r.camera.cy *= center;
  };
}

Change
principalPoint(double dx, double dy)
{
  return [=](Recording& r) {
    r.camera.cx += dx;
    r.camera.cy += dy;
  };
}

/** Images squeezed to 3/4 of their height: pixels that are not square. */
void
squeeze(Recording& r)
{
  const cv::Size size(r.camera.width, r.camera.height * 3 / 4);
  changePixels(r.color, [&](std::size_t, const cv::Mat& pixels) {
    cv::Mat result;
    cv::resize(pixels, result, size, 0, 0, cv::INTER_AREA);
    return result;
  });
  changePixels(r.depth, [&](std::size_t, const cv::Mat& pixels) {
    cv::Mat result;
    cv::resize(pixels, result, size, 0, 0, cv::INTER_NEAREST);
    return result;
  });
  r.camera.height = size.height;
  r.camera.fy *= 0.75;
  r.camera.cy = 0.75 * (r.camera.cy + 0.5) - 0.5;
}

void
turnUpright(Recording& r)
{
  for (std::vector<Image>* images : {&r.color, &r.depth})
    changePixels(*images, [](std::size_t, const cv::Mat& pixels) {
      cv::Mat result;
      cv::rotate(pixels, result, cv::ROTATE_90_CLOCKWISE);
      return result;
    });
}

/** The camera of images that turnUpright() turned. */
void
turnCamera(Recording& r)
{
  auto& c = r.camera;
  const double cx = c.cx;
  c.cx = c.height - 1 - c.cy;
  c.cy = cx;
  std::swap(c.fx, c.fy);
  std::swap(c.width, c.height);
}

/** The middle of the images alone, which the intrinsics do not know. */
void
crop(Recording& r)
{
  const cv::Rect middle(r.camera.width / 4, r.camera.height / 8, r.camera.width / 2,
                        r.camera.height * 3 / 4);
  for (std::vector<Image>* images : {&r.color, &r.depth})
    changePixels(*images,
                 [&](std::size_t, const cv::Mat& pixels) { return pixels(middle).clone(); });
}

/** In 7-Scenes' layout, without a calibration, of another camera than theirs. */
void
asSevenScenes(Recording& r)
{
  toOpen3d(r);
  r.layout = Layout::SEVEN_SCENES;
  r.has_calibration = false;
  for (std::vector<Image>* images : {&r.color, &r.depth})
    for (Image& image : *images)
      image.name = "frame-00" + image.name;
}

/** The same with poses, so that nothing tells it from 7-Scenes but the images. */
void
asSevenScenesWithPoses(Recording& r)
{
  asSevenScenes(r);
  const std::vector<Image> frames = r.color;
  r.afterwards = [frames](const std::string& folder) {
    for (const Image& image : frames)
      writeText(folder + "/" + image.name + ".pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  };
}

} // namespace

std::vector<Input>
unitInputs()
{
  const std::vector<std::string> table = {"table"}, both = {"table", "desk"},
                                 all = {"table", "walls", "desk"};
  const auto depthPixels = [](const PixelChange& change) {
    return [=](Recording& r) { changePixels(r.depth, change); };
  };
  return {
      {"tenth_of_mm", both, open3dUnits([](double z) { return 1e4 * z; }), UNITS, 0.5, true},
      {"centimetres", all, open3dUnits([](double z) { return 100 * z; }), UNITS, 0.5, true},
      {"metres", both, open3dUnits([](double z) { return std::round(z); }), UNITS},
      {"tum_units_as_mm", both, open3dUnits([](double z) { return 5000 * z; }), UNITS},
      {"mm_as_tum_units", all, units([](double z) { return 1000 * z; }), UNITS},
      {"cm_as_tum_units", table, units([](double z) { return 100 * z; }), UNITS},
      {"inches", table, open3dUnits([](double z) { return 39.37 * z; }), UNITS},
      {"inverse_depth", both, units([](double z) { return 8000 / z; }), NO_DEPTH},
      {"disparity", table, open3dUnits([](double z) { return 525 * 0.075 / z * 32; }), NO_DEPTH},
      {"eight_bits_scaled", both, units([](double z) { return std::round(z * 255 / 5) * 98; }),
       "in steps"},
      {"eight_bit_files", table, depthPixels([](std::size_t, const cv::Mat& pixels) {
         cv::Mat result;
         pixels.convertTo(result, CV_8U, 1. / 98);
         return result;
       }),
       "8[- ]bit"},
      {"stretched_for_display", table,
       depthPixels([](std::size_t, const cv::Mat& pixels) { return stretched(pixels); }), NO_DEPTH},
      {"bytes_swapped", both,
       depthPixels([](std::size_t, const cv::Mat& pixels) { return withSwappedBytes(pixels); }),
       NO_DEPTH},
      {"clipped_to_1_5_m", both, units([](double z) { return 5000 * std::min(z, 1.5); }),
       "clipped|one and the same depth|the same depth"},
      {"far_depth_left_out", both, units([](double z) { return z > 1.6 ? 0 : 5000 * z; }), ""},
      {"wild_pixels", both, depthPixels(withWildPixels), ""},
      {"steps_of_5_cm", both, units([](double z) { return 5000 * 0.05 * std::round(z / 0.05); }),
       "in steps|quanti"},
      {"ray_lengths", both, rayLengths,
       "along the ray|length of the ray|ray lengths?|distance from the camera"},
      {"30_cm_too_far", table, units([](double z) { return 5000 * (z + 0.3); }),
       "offset|too far|wrong unit"},
  };
}

std::vector<Input>
cameraInputs()
{
  const std::vector<std::string> table = {"table"}, both = {"table", "desk"},
                                 all = {"table", "walls", "desk"};
  const auto swappedFocalLengths = [](Recording& r) {
    squeeze(r);
    std::swap(r.camera.fx, r.camera.fy);
  };
  const auto upright = [](Recording& r) {
    turnUpright(r);
    turnCamera(r);
  };
  const auto otherSize = [](Recording& r) {
    toOpen3d(r);
    r.camera.width /= 2;
    r.camera.height /= 2;
  };
  const auto lensOfAnother = [](Recording& r) {
    r.camera.k1 = 0.26;
    r.camera.k2 = -0.95;
    r.camera.k3 = 1.16;
  };
  return {
      {"half_size_intrinsics", both, lens(0.5, 0.5), LENS, 0.5, true},
      {"double_size_intrinsics", table, lens(2, 2), LENS},
      {"double_focal_length", both, lens(2), LENS},
      {"half_focal_length", table, lens(0.5), LENS},
      {"focal_length_7_percent_long", both, lens(1.07), LENS},
      {"focal_length_7_percent_short", both, lens(0.93), LENS},
      {"focal_length_15_percent_long", both, lens(1.15), LENS, 0.5, true},
      {"focal_length_15_percent_short", both, lens(0.85), LENS},
      {"focal_length_30_percent_long", all, lens(1.3), LENS},
      {"focal_length_30_percent_short", both, lens(0.7), LENS},
      {"principal_point_off", both, principalPoint(60, -40), LENS},
      {"principal_point_far_off", table, principalPoint(-160, 100), LENS},
      {"pixels_not_square", table, squeeze, ""},
      {"focal_lengths_swapped", table, swappedFocalLengths, LENS},
      {"focal_length_one_long", both, [](Recording& r) { r.camera.fx *= 1.2; }, LENS},
      {"lens_of_another_camera", table, lensOfAnother,
       "distortion|lens|focal length|principal point"},
      {"upright", both, upright, ""},
      {"upright_lying_intrinsics", both, turnUpright, LENS},
      {"intrinsics_of_another_size", table, otherSize,
       "intrinsics .*are for 320x240|principal point .*320x240"},
      {"cropped", table, crop, LENS},
      {"as_seven_scenes", table, asSevenScenes, "intrinsics are unknown"},
      {"as_seven_scenes_with_poses", table, asSevenScenesWithPoses, LENS},
  };
}

} // namespace adversity
