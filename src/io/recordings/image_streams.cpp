// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/image_streams.h"

#include "io/recordings/name_numbers.h"
#include "io/recordings/time_stamps.h"

#include <set>

namespace bundle_icp {

namespace {

// The number that a part of a name says; `place` where it says none, or none that can be counted.
std::size_t
numberOr(std::size_t place, const std::string& part)
{
  return isNumber(part) && numberOf(part) < 1e18 ? std::size_t(numberOf(part)) : place;
}

// Numbers each image by the last number that differs, or by its place; its time is n / 30 s.
void
numberImages(Stream& images)
{
  const auto parts = distinguishingParts(stemsOf(images));
  std::set<std::size_t> numbers;
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i].number = numberOr(i, parts[i].back());
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
    images[i].number = parts[i].size() == 2 ? numberOr(i, parts[i][0]) : i;
  }
  return unit;
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
sayTimes(const TimeUnit& unit, Recording& recording)
{
  recording.findings.push_back(
      {Severity::NOTE, "time_stamps", std::string("the names hold times in ") + unit.name, {}, ""});
}

} // namespace

void
sayNoTimes(Recording& recording)
{
  recording.has_times = false;
  recording.findings.push_back({Severity::NOTE,
                                "time_stamps",
                                "there are no time stamps: frame n counts as taken at n / 30 s",
                                {},
                                ""});
}

void
placeInTime(Stream& files, Recording& recording)
{
  if (const std::optional<TimeUnit> unit = takeTimes(files))
    return sayTimes(*unit, recording);
  numberImages(files);
  sayNoTimes(recording);
}

void
pairImages(Stream color, Stream depth, const DatasetOptions& options, const std::string& folder,
           Recording& recording)
{
  const std::optional<TimeUnit> color_unit = takeTimes(color), depth_unit = takeTimes(depth);
  if (!color_unit || !depth_unit) {
    sayNoTimes(recording);
    return pairNumberedImages(std::move(color), std::move(depth), folder, recording);
  }
  sayTimes(*color_unit, recording);
  if (countSameNames(color, depth) < std::max(color.size(), depth.size()))
    pairByTime(color, depth, options.max_time_difference, folder, recording);
  else
    pairByName(color, depth, folder, recording);
}

void
pairNumberedImages(Stream color, Stream depth, const std::string& folder, Recording& recording)
{
  numberImages(color);
  numberImages(depth);
  pairByName(color, depth, folder, recording);
}

void
checkStamps(const std::string& source, Recording& recording)
{
  std::vector<double> stamps;
  for (const RecordedFrame& frame : recording.frames)
    stamps.push_back(frame.timestamp);
  const std::string fault = faultOfStamps(stamps, true);
  if (fault.empty())
    return;
  recording.is_ordered = false;
  recording.findings.push_back({Severity::WARNING,
                                "time_stamps",
                                "the time stamps of " + source + " cannot be used: " + fault,
                                {},
                                "nothing is concluded from time; record with true time stamps"});
}

} // namespace bundle_icp
