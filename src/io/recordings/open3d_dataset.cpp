// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/calibration_files.h"
#include "io/recordings/name_numbers.h"
#include "io/recordings/pairing.h"
#include "io/recordings/time_stamps.h"

#include <boost/filesystem.hpp>
#include <pcl/exceptions.h>

#include <set>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

// Numbers each image by the first number that differs, or by its place; its time is n / 30 s.
void
numberImages(Stream& images)
{
  const auto parts = distinguishingParts(stemsOf(images));
  std::set<std::size_t> numbers;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::string& part = parts[i].back();
    images[i].number = isNumber(part) && numberOf(part) < 1e18 ? std::size_t(numberOf(part)) : i;
    numbers.insert(images[i].number);
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (numbers.size() < images.size())
      images[i].number = i;
    images[i].timestamp = double(images[i].number) / 30;
  }
}

// Whether the last number that differs is a time: then each image gets its stamp, and as number
// the one before, or its place.
std::optional<TimeUnit>
takeTimes(Stream& images)
{
  const auto parts = distinguishingParts(stemsOf(images));
  std::vector<double> times;
  for (const auto& part : parts) {
    if (part.size() > 2 || !isNumber(part.back()))
      return std::nullopt;
    times.push_back(numberOf(part.back()));
  }
  const std::optional<TimeUnit> unit = timeUnitOf(times);
  // A number and a time count up together.
  if (!unit || !std::is_sorted(times.begin(), times.end()))
    return std::nullopt;
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i].timestamp = times[i] * unit->seconds;
    images[i].number = parts[i].size() == 2 ? std::size_t(numberOf(parts[i][0])) : i;
  }
  return unit;
}

fs::path
colorFolder(const fs::path& folder)
{
  for (const char* const name : {"color", "image", "rgb"})
    if (fs::is_directory(folder / name))
      return folder / name;
  return {};
}

// How many of the images have a partner of the same name apart from what is common to the stream.
std::size_t
countSameNames(const Stream& color, const Stream& depth)
{
  const auto color_parts = distinguishingParts(stemsOf(color));
  const auto depth_parts = distinguishingParts(stemsOf(depth));
  const std::set<std::vector<std::string>> known(depth_parts.begin(), depth_parts.end());
  return std::size_t(std::count_if(color_parts.begin(), color_parts.end(),
                                   [&](const auto& parts) { return known.count(parts) > 0; }));
}

void
collectFrames(const std::string& folder, const DatasetOptions& options, Recording& recording)
{
  Stream color = listImages(colorFolder(folder).string()),
         depth = listImages((fs::path(folder) / "depth").string());
  const std::optional<TimeUnit> color_unit = takeTimes(color), depth_unit = takeTimes(depth);
  const bool are_times = color_unit && depth_unit;
  if (are_times)
    recording.findings.push_back({Severity::NOTE,
                                  "time_stamps",
                                  std::string("the names hold times in ") + color_unit->name,
                                  {},
                                  ""});
  if (are_times && countSameNames(color, depth) < std::max(color.size(), depth.size()))
    return pairByTime(color, depth, options.max_time_difference, folder, recording);
  if (!are_times) {
    numberImages(color);
    numberImages(depth);
    recording.has_times = false;
    recording.findings.push_back({Severity::NOTE,
                                  "time_stamps",
                                  "there are no time stamps: frame n counts as taken at n / 30 s",
                                  {},
                                  ""});
  }
  pairByName(color, depth, folder, recording);
}

// TUM's images without its lists: units and camera are then unknown.
void
refuseTumWithoutLists(const std::string& folder, const DatasetOptions& options,
                      const Recording& recording)
{
  const std::string stem = fs::path(recording.frames[0].color_file).stem().string();
  const bool is_tum = colorFolder(folder).filename() == "rgb" && isNumber(stem) &&
                      stem.find('.') != std::string::npos;
  if (is_tum && !options.depth_scale && !recording.intrinsics)
    throw pcl::IOException(folder + ": the depth images' unit is unknown: rgb/ and depth/ with "
                                    "times as names are TUM RGB-D's, but its lists rgb.txt and "
                                    "depth.txt are absent; give the unit with --depth-scale (TUM "
                                    "5000)");
}

} // namespace

bool
isOpen3dFolder(const std::string& folder)
{
  return !colorFolder(folder).empty() && fs::is_directory(fs::path(folder) / "depth");
}

Recording
readOpen3dFolder(const std::string& folder, const DatasetOptions& options)
{
  Recording recording;
  recording.format = "Open3D";
  recording.depth_scale = 1000;
  recording.depth_scale_source = "the format (Open3D)";
  collectFrames(folder, options, recording);
  readCalibrationFile(folder, recording);
  refuseTumWithoutLists(folder, options, recording);
  return recording;
}

} // namespace bundle_icp
