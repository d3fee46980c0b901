// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "changes.h"
#include "inputs.h"

#include <algorithm>

namespace adversity {
namespace {

using Change = std::function<void(Recording&)>;

const char* const POOR = "dark|blur|texture|\\([0-9]+ features\\)";
const char* const STILL = "repeat|the same|stands? still|static|does not move|no two frames";
const char* const HELD = "moves with the camera \\(";
const char* const PASSING = "something moves there|moves with the camera \\(";

Change
colorPixels(const PixelChange& change)
{
  return [=](Recording& r) { changePixels(r.color, change); };
}

Change
depthPixels(const PixelChange& change)
{
  return [=](Recording& r) { changePixels(r.depth, change); };
}

cv::Mat
blurred(const cv::Mat& pixels, double sigma)
{
  cv::Mat result;
  cv::GaussianBlur(pixels, result, {}, sigma);
  return result;
}

cv::Mat
noise(const cv::Mat& pixels, std::size_t seed, int most)
{
  cv::Mat result(pixels.size(), pixels.type());
  cv::RNG random(seed + 5);
  random.fill(result, cv::RNG::UNIFORM, 0, most);
  return result;
}

cv::Mat
withWatermark(std::size_t index, const cv::Mat& pixels)
{
  cv::Mat result = pixels.clone();
  for (int y = 40; y < pixels.rows; y += pixels.rows / 5)
    cv::putText(result, "CAM-01 2024-05-17 16:0" + std::to_string(index / 12), {15, y},
                cv::FONT_HERSHEY_SIMPLEX, 1.1, {255, 255, 255}, 3);
  cv::rectangle(result, {5, 5, pixels.cols - 10, pixels.rows - 10}, {0, 255, 0}, 3);
  return result;
}

/** What lies outside of the middle is black, or without depth. */
cv::Mat
withBorder(std::size_t, const cv::Mat& pixels)
{
  cv::Mat result = cv::Mat::zeros(pixels.size(), pixels.type());
  const cv::Rect middle(pixels.cols / 6, pixels.rows / 6, pixels.cols * 2 / 3, pixels.rows * 2 / 3);
  pixels(middle).copyTo(result(middle));
  return result;
}

/** A camera on a tripod; every image with noise of its own. */
void
standStill(Recording& r)
{
  const Image color = r.color.front(), depth = r.depth.front();
  for (std::size_t i = 0; i < r.color.size(); ++i) {
    r.color[i].pixels = withNoise(color.pixels, 3, i);
    r.depth[i].pixels = withNoise(depth.pixels, 8, i);
    r.color[i].place = color.place;
  }
}

/** Frames `first` to `last` repeat the first of them, bit by bit. */
Change
freeze(std::size_t first, std::size_t last)
{
  return [=](Recording& r) {
    for (std::size_t i = first; i < std::min(last, r.color.size()); ++i) {
      r.color[i].pixels = r.color[first].pixels;
      r.color[i].place = r.color[first].place;
      r.depth[i].pixels = r.depth[first].pixels;
    }
  };
}

/** Frames of another recording in place of these; they are in another world. */
Change
othersAt(const std::vector<std::size_t>& places, const std::string& base)
{
  return [=](Recording& r) {
    const Recording& other = baseRecording(base);
    for (const std::size_t i : places) {
      r.color[i].pixels = other.color[i].pixels;
      r.color[i].place = other.color[i].place + Eigen::Vector3d(10, 20, 30);
      r.depth[i].pixels = other.depth[i].pixels;
    }
  };
}

/** Frames in a random order whose names and stamps follow this order. */
void
shuffle(Recording& r)
{
  const std::vector<Image> color = r.color, depth = r.depth;
  for (std::size_t i = 0; i < color.size(); ++i) {
    const std::size_t from = (7 * i + 3) % color.size();
    r.color[i].pixels = color[from].pixels;
    r.color[i].place = color[from].place;
    r.depth[i].pixels = depth[from].pixels;
  }
}

/** A part of a robot in the lower third, 25 cm from the camera, in real images. */
void
addGripper(Recording& r)
{
  cv::Mat cells(40, 160, CV_8UC3), texture;
  cv::RNG random(2);
  random.fill(cells, cv::RNG::UNIFORM, 0, 255);
  const int height = r.camera.height / 3;
  cv::resize(cells, texture, {r.camera.width, height}, 0, 0, cv::INTER_NEAREST);
  changePixels(r.color, [&](std::size_t i, const cv::Mat& pixels) {
    cv::Mat result = pixels.clone();
    withNoise(texture, 2, i).copyTo(result.rowRange(pixels.rows - height, pixels.rows));
    return result;
  });
  changePixels(r.depth, [&](std::size_t i, const cv::Mat& pixels) {
    cv::Mat result = pixels.clone();
    const cv::Mat near(height, pixels.cols, CV_16UC1, cv::Scalar(0.25 * r.depth_scale));
    withNoise(near, 4, i).copyTo(result.rowRange(pixels.rows - height, pixels.rows));
    return result;
  });
}

/** A board that somebody carries past, 70 cm from the camera: a fifth of the image. */
void
addBoard(Recording& r)
{
  cv::Mat cells(40, 30, CV_8UC3), texture;
  cv::RNG random(3);
  random.fill(cells, cv::RNG::UNIFORM, 0, 255);
  const cv::Size size(r.camera.width / 3, r.camera.height * 2 / 3);
  cv::resize(cells, texture, size, 0, 0, cv::INTER_NEAREST);
  for (std::size_t i = 0; i < r.color.size(); ++i) {
    const int x = int(i) * (r.camera.width - size.width) / int(r.color.size());
    const cv::Rect place({x, r.camera.height / 4}, size);
    cv::Mat color = r.color[i].pixels.clone(), depth = r.depth[i].pixels.clone();
    withNoise(texture, 2, i).copyTo(color(place));
    const cv::Mat near(size, CV_16UC1, cv::Scalar(0.7 * r.depth_scale));
    withNoise(near, 8, i).copyTo(depth(place));
    r.color[i].pixels = color;
    r.depth[i].pixels = depth;
  }
}

} // namespace

std::vector<Input>
sceneInputs()
{
  const std::vector<std::string> table = {"table"}, both = {"table", "desk"};
  const auto nothing = [](Recording&) {};
  const auto eraseFrames = [](Recording& r) {
    r.color.erase(r.color.begin() + 8, r.color.begin() + 16);
    r.depth.erase(r.depth.begin() + 8, r.depth.begin() + 16);
  };
  const auto noiseFrames = [](Recording& r) {
    for (const std::size_t i : {3, 10, 16}) {
      r.color[i].pixels = noise(r.color[i].pixels, i, 256);
      r.depth[i].pixels = noise(r.depth[i].pixels, i, 20000);
    }
  };
  const std::vector<std::size_t> second_half = {12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23};
  return {
      {"clean",
       {"table", "walls", "desk", "kitchen", "flat", "other_table", "slow"},
       nothing,
       "",
       0.8,
       true},
      {"turning_on_the_spot", {"turning"}, nothing, "", 0.8},
      {"dark_start", both, colorPixels([](std::size_t i, const cv::Mat& pixels) {
         return i < 6 ? cv::Mat(pixels * 0) : pixels;
       }),
       ""},
      {"all_dark", table,
       colorPixels([](std::size_t, const cv::Mat& pixels) { return cv::Mat(pixels * 0.02); }),
       POOR},
      {"dim", both,
       colorPixels([](std::size_t, const cv::Mat& pixels) { return cv::Mat(pixels * 0.3); }), ""},
      {"overexposed", table, colorPixels([](std::size_t, const cv::Mat& pixels) {
         return cv::Mat(pixels * 1.6 + cv::Scalar(40, 40, 40));
       }),
       ""},
      {"all_blurred", both,
       colorPixels([](std::size_t, const cv::Mat& pixels) { return blurred(pixels, 6); }), POOR},
      {"many_blurred", {"blurred"}, nothing, ""},
      {"unsteady_light", {"unsteady_light"}, nothing, ""},
      {"depth_holes", {"holes"}, nothing, ""},
      {"without_texture", {"plain"}, nothing, POOR},
      {"some_without_depth", both, depthPixels([](std::size_t i, const cv::Mat& pixels) {
         return i % 3 == 1 ? cv::Mat(pixels * 0) : pixels;
       }),
       ""},
      {"one_with_depth", table, depthPixels([](std::size_t i, const cv::Mat& pixels) {
         return i == 11 ? pixels : cv::Mat(pixels * 0);
       }),
       "next to no depth|no depth|has depth|have depth"},
      {"none_with_depth", table,
       depthPixels([](std::size_t, const cv::Mat& pixels) { return cv::Mat(pixels * 0); }),
       "next to no depth|no depth|has depth|have depth"},
      {"noise_frames", both, noiseFrames, "", 0.5, true},
      {"frozen_for_a_while", both, freeze(8, 16), ""},
      {"camera_on_a_tripod", both, standStill, ""},
      {"one_frame_for_ever", table, freeze(0, 24), STILL},
      {"gap", both, eraseFrames, "gap|not connected", 0.4},
      {"watermark", both, colorPixels(withWatermark), ""},
      {"color_with_border", both, colorPixels(withBorder), ""},
      {"depth_with_border", both, depthPixels(withBorder), ""},
      {"color_inverted", table,
       colorPixels([](std::size_t, const cv::Mat& pixels) { return cv::Mat(~pixels); }), ""},
      {"color_is_grey", table, colorPixels([](std::size_t, const cv::Mat& pixels) {
         cv::Mat grey;
         cv::cvtColor(pixels, grey, cv::COLOR_BGR2GRAY);
         return grey;
       }),
       ""},
      {"two_rooms", table, othersAt(second_half, "other_table"), "", 0.4, true},
      {"frames_of_another_recording", table, othersAt({5, 12, 18}, "other_table"), ""},
      {"order_shuffled", both, shuffle, ""},
      {"gripper_simulated", {"gripper"}, nothing, HELD},
      {"gripper_pasted", {"table", "desk"}, addGripper, HELD, 0.5, true},
      {"person_walks_by", {"person", "small_person"}, nothing, PASSING},
      {"board_carried_past", both, addBoard, PASSING},
  };
}

} // namespace adversity
