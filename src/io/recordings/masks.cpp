// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/masks.h"

#include "io/image_file.h"
#include "io/recordings/association.h"
#include "io/recordings/name_numbers.h"
#include "io/recordings/pairing.h"
#include "io/recordings/time_stamps.h"
#include "io/text_file.h"

#include <boost/algorithm/string/case_conv.hpp>
#include <boost/filesystem.hpp>

#include <algorithm>
#include <map>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

/** Masks that are read for the share of pixels that they leave out. */
constexpr std::size_t MAX_SAMPLES = 32;

std::string
stemOf(const std::string& file)
{
  return fs::path(file).stem().string();
}

void
give(RecordedFrame& frame, StreamImage& mask)
{
  frame.mask_file = mask.file;
  mask.number = 1; // it has a frame
}

std::size_t
pairBySameName(Stream& masks, std::vector<RecordedFrame>& frames)
{
  std::map<std::string, StreamImage*> by_stem;
  for (StreamImage& mask : masks)
    by_stem.emplace(stemOf(mask.file), &mask);
  // Of both streams, numbers may not mean the same moment: never of one for some frames only.
  std::size_t count = 0;
  for (const auto file : {&RecordedFrame::color_file, &RecordedFrame::depth_file}) {
    for (RecordedFrame& frame : frames)
      if (const auto found = by_stem.find(stemOf(frame.*file)); found != by_stem.end()) {
        give(frame, *found->second);
        ++count;
      }
    if (count > 0)
      return count;
  }
  return 0;
}

/** Where names hold times, as those of the images may. */
std::size_t
pairMasksByTime(Stream& masks, std::vector<RecordedFrame>& frames, double max_difference)
{
  std::vector<double> times, stamps;
  for (const auto& parts : distinguishingParts(stemsOf(masks))) {
    if (parts.empty() || !isNumber(parts.back()))
      return 0;
    times.push_back(numberOf(parts.back()));
  }
  const std::optional<TimeUnit> unit = timeUnitOf(times);
  if (!unit)
    return 0;
  for (double& time : times)
    time *= unit->seconds;
  for (const RecordedFrame& frame : frames)
    stamps.push_back(frame.timestamp);
  const auto pairs = associate(stamps, times, max_difference);
  for (const auto& [i, j] : pairs)
    give(frames[i], masks[j]);
  return pairs.size();
}

std::size_t
pairByNumber(Stream& masks, std::vector<RecordedFrame>& frames)
{
  Stream color;
  for (const RecordedFrame& frame : frames)
    color.push_back({0, 0, frame.color_file});
  const auto mask_parts = distinguishingParts(stemsOf(masks));
  const auto color_parts = distinguishingParts(stemsOf(color));
  std::map<std::vector<std::string>, std::size_t> numbered;
  for (std::size_t j = 0; j < masks.size(); ++j)
    numbered.emplace(mask_parts[j], j);
  std::size_t count = 0;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (const auto found = numbered.find(color_parts[i]); found != numbered.end()) {
      give(frames[i], masks[found->second]);
      ++count;
    }
  return count;
}

} // namespace

void
pairMasks(const std::string& folder, double max_time_difference, Recording& recording)
{
  fs::path place;
  for (const char* const name : {"masks", "mask"})
    if (fs::is_directory(fs::path(folder) / name))
      place = fs::path(folder) / name;
  if (place.empty())
    return;
  Stream masks = listImages(place.string());
  std::string rule = "by their names";
  std::size_t count = pairBySameName(masks, recording.frames);
  if (count == 0 && recording.has_times) {
    rule = "by time";
    count = pairMasksByTime(masks, recording.frames, max_time_difference);
  }
  if (count == 0) {
    rule = "by the number that differs in their names";
    count = pairByNumber(masks, recording.frames);
  }
  recording.mask_rule = "from " + place.string() + ", paired " + rule;
  if (count == 0)
    recording.mask_rule = "from " + place.string() + ", whose names and times are those of none";
  for (const StreamImage& mask : masks)
    if (mask.number == 0)
      recording.skipped.push_back({mask.file, "a mask without a frame"});
}

cv::Mat
readMask(const std::string& file, const cv::Size& size)
{
  const std::string extension = boost::to_lower_copy(fs::path(file).extension().string());
  if (extension == ".jpg" || extension == ".jpeg")
    throw UnsuitableImage(file + ": a mask as JPEG, which does not keep zeros; masks must be PNG");
  const cv::Mat image = readAnyImage(file);
  if (image.size() != size)
    throw UnsuitableImage(file + ": mask of " + std::to_string(image.cols) + "x" +
                          std::to_string(image.rows) + " where the colour image has " +
                          std::to_string(size.width) + "x" + std::to_string(size.height));
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  // The fourth is opacity.
  cv::Mat left_out = channels[0] == 0;
  for (std::size_t c = 1; c < std::min<std::size_t>(3, channels.size()); ++c)
    left_out &= channels[c] == 0;
  return left_out;
}

void
sayMasks(const cv::Size& size, Recording& recording)
{
  if (recording.mask_rule.empty())
    return;
  std::vector<std::string> files;
  for (const RecordedFrame& frame : recording.frames)
    if (!frame.mask_file.empty())
      files.push_back(frame.mask_file);
  const std::size_t total = recording.frames.size(), samples = std::min(MAX_SAMPLES, files.size());
  double left_out = 0, pixels = 0;
  for (std::size_t k = 0; k < samples; ++k) {
    try {
      left_out += cv::countNonZero(readMask(files[k * files.size() / samples], size));
      pixels += size.area();
    }
    catch (const UnsuitableImage&) {
      throw;
    }
    catch (const pcl::IOException&) { // its frame is left out with the reason
    }
  }
  const double share = pixels > 0 ? left_out / pixels : 0;
  const bool lacks_many = 2 * files.size() < total;
  Finding finding{lacks_many ? Severity::WARNING : Severity::NOTE,
                  "masks",
                  std::to_string(files.size()) + " of " + std::to_string(total) +
                      " frames have a mask (" + recording.mask_rule + "), which leaves out " +
                      shortText(100 * share, 2) + " % of their pixels",
                  {{"masks", double(files.size())},
                   {"frames_without_mask", double(total - files.size())},
                   {"share_left_out", share}},
                  lacks_many
                      ? "give each frame a mask with the name of its colour image, or ignore "
                        "the folder with --no-mask"
                      : ""};
  if (files.size() < total)
    finding.what += "; the other " + std::to_string(total - files.size()) + " are used whole";
  recording.findings.push_back(finding);
}

} // namespace bundle_icp
