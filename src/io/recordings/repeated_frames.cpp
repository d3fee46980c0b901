// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/repeated_frames.h"

#include "io/image_file.h"

#include <boost/filesystem.hpp>
#include <opencv2/core.hpp>

#include <algorithm>
#include <array>
#include <fstream>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

/** Compares only files of the same size; images that differ do so in their first bytes. */
bool
haveSameBytes(const std::string& a, const std::string& b)
{
  boost::system::error_code code;
  const std::uintmax_t size = fs::file_size(a, code);
  if (code || size == 0 || fs::file_size(b, code) != size || code)
    return false;
  std::ifstream first(a, std::ios::binary), second(b, std::ios::binary);
  std::array<char, 1 << 14> bytes, others;
  while (first && second) {
    first.read(bytes.data(), bytes.size());
    second.read(others.data(), others.size());
    if (first.gcount() != second.gcount() ||
        !std::equal(bytes.begin(), bytes.begin() + first.gcount(), others.begin()))
      return false;
  }
  return first.eof() && second.eof();
}

/** Black images and images without any depth are all alike, though taken at other moments. */
bool
isUniform(const std::string& file, cv::Mat (*read)(const std::string&))
{
  try {
    const cv::Mat image = read(file).reshape(1);
    double least = 0, most = 0;
    cv::minMaxLoc(image, &least, &most);
    return least == most;
  }
  catch (const pcl::IOException&) {
    return true; // says nothing
  }
}

/** 0 = a new frame, else a sum of 1 for a repeated colour and 2 for a repeated depth image. */
int
kindOf(const RecordedFrame& frame, const RecordedFrame& before)
{
  const int kind = int(haveSameBytes(frame.color_file, before.color_file)) +
                   2 * int(haveSameBytes(frame.depth_file, before.depth_file));
  const bool is_uniform = (kind == 1 && isUniform(frame.color_file, readColorImage)) ||
                          (kind == 2 && isUniform(frame.depth_file, readDepthImage));
  return is_uniform ? 0 : kind;
}

/** A kind of repetition and how many frames have it. */
struct Repetition {
  const char* images;
  const char* reason;
  std::size_t count;
};

void
say(const Repetition& repetition, std::size_t num_frames, bool is_left_out, Recording& recording)
{
  if (repetition.count == 0)
    return;
  const double share = double(repetition.count) / double(num_frames);
  const bool is_both = std::string(repetition.images) == "both images";
  recording.findings.push_back(
      {is_left_out || is_both ? Severity::NOTE : Severity::WARNING,
       "repeated_images",
       std::to_string(repetition.count) + " of " + std::to_string(num_frames) + " frames repeat " +
           repetition.images + " of the frame before" +
           (is_left_out ? ": they are left out" : "; they stay, since few frames would be left"),
       {{"frames", double(repetition.count)}, {"share", share}},
       is_left_out || is_both ? "" : "record colour and depth at the same rate"});
}

} // namespace

void
leaveOutRepeatedFrames(Recording& recording)
{
  const std::size_t num_frames = recording.frames.size();
  std::vector<int> kinds(num_frames);
  for (std::size_t i = 1; i < num_frames; ++i)
    kinds[i] = kindOf(recording.frames[i], recording.frames[i - 1]);
  const auto count = [&](int kind) {
    return std::size_t(std::count(kinds.begin(), kinds.end(), kind));
  };
  const Repetition repetitions[] = {
      {"the colour image", "repeats the colour image of the frame before", count(1)},
      {"the depth image", "repeats the depth image of the frame before", count(2)},
      {"both images", "repeats the frame before", count(3)}};
  const std::size_t num_new = count(0);
  const bool is_left_out = 4 * num_new > num_frames;
  for (const Repetition& repetition : repetitions)
    say(repetition, num_frames, is_left_out, recording);
  if (!is_left_out)
    return;
  std::vector<RecordedFrame> kept;
  for (std::size_t i = 0; i < num_frames; ++i)
    if (kinds[i] == 0)
      kept.push_back(recording.frames[i]);
    else
      recording.skipped.push_back(
          {recording.frames[i].color_file, repetitions[kinds[i] - 1].reason});
  recording.frames = std::move(kept);
}

} // namespace bundle_icp
