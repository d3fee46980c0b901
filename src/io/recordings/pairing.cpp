// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/pairing.h"

#include "io/recordings/association.h"
#include "io/recordings/name_numbers.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/algorithm/string/case_conv.hpp>
#include <boost/filesystem.hpp>

#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

namespace bundle_icp {
namespace {

using Parts = std::vector<std::string>;

std::vector<double>
stampsOf(const Stream& stream)
{
  std::vector<double> result;
  for (const StreamImage& image : stream)
    result.push_back(image.timestamp);
  return result;
}

std::string
timeSpan(const Stream& stream)
{
  const std::vector<double> times = stampsOf(stream);
  const auto [first, last] = std::minmax_element(times.begin(), times.end());
  return std::to_string(*first) + " to " + std::to_string(*last) + " s";
}

/** Median over the colour images of the time to the nearest depth image [s]. */
double
medianDistance(const Stream& color, const Stream& depth)
{
  std::vector<double> times = stampsOf(depth), distances;
  std::sort(times.begin(), times.end());
  for (const StreamImage& image : color) {
    const auto next = std::lower_bound(times.begin(), times.end(), image.timestamp);
    double distance = std::numeric_limits<double>::infinity();
    if (next != times.end())
      distance = *next - image.timestamp;
    if (next != times.begin())
      distance = std::min(distance, image.timestamp - *(next - 1));
    distances.push_back(distance);
  }
  std::sort(distances.begin(), distances.end());
  return distances[distances.size() / 2];
}

void
refuseWithoutOverlap(const Stream& color, const Stream& depth, double max_difference,
                     const std::string& folder)
{
  const double distance = medianDistance(color, depth);
  std::string hint;
  if (distance < 1)
    hint = "; the median distance is " + shortText(distance, 3) +
           " s: if that is right, allow it with --max-time-difference";
  throw IOException(folder + ": no overlap in time: colour images span " + timeSpan(color) +
                    ", depth images " + timeSpan(depth) + ", and none lie within " +
                    shortText(max_difference, 6) + " s of each other" + hint);
}

void
sayTimes(const Stream& color, const Stream& depth, double max_difference, Recording& recording,
         std::vector<double> differences)
{
  std::sort(differences.begin(), differences.end());
  const double median = differences[differences.size() / 2], largest = differences.back();
  const std::size_t possible = std::min(color.size(), depth.size());
  Finding finding{
      Severity::NOTE,
      "pairing",
      "colour and depth images are paired by time: " + std::to_string(differences.size()) +
          " frames of " + std::to_string(color.size()) + " colour and " +
          std::to_string(depth.size()) + " depth images, " + shortText(1e3 * median, 3) +
          " ms apart (median), " + shortText(1e3 * largest, 3) + " ms at most",
      {{"frames", double(differences.size())},
       {"color_images", double(color.size())},
       {"depth_images", double(depth.size())},
       {"median_difference_s", median},
       {"largest_difference_s", largest}},
      ""};
  if (2 * differences.size() < possible) {
    finding.severity = Severity::WARNING;
    finding.remedy = "the nearest depth image is " + shortText(medianDistance(color, depth), 3) +
                     " s away in the middle; --max-time-difference allows more than " +
                     shortText(max_difference, 3) + " s";
  }
  recording.findings.push_back(finding);
}

/** Images that were taken while the other camera did not run; many of them tell of a list that is
 *  cut off. */
void
sayIfCutOff(const char* what, const Stream& stream, const Stream& other, double max_difference,
            Recording& recording)
{
  constexpr double most = 0.2;
  const std::vector<double> times = stampsOf(other);
  const auto ends = std::minmax_element(times.begin(), times.end());
  const double first = *ends.first - max_difference, last = *ends.second + max_difference;
  const auto outside =
      double(std::count_if(stream.begin(), stream.end(), [&](const StreamImage& image) {
        return image.timestamp < first || image.timestamp > last;
      }));
  if (outside < 2 || outside <= most * double(stream.size()))
    return;
  recording.findings.push_back(
      {Severity::WARNING,
       "pairing",
       shortText(outside, 6) + " of " + std::to_string(stream.size()) + " " + what +
           " images were taken before or after all images of the other kind: they are not used",
       {{"images", outside}, {"images_of_the_kind", double(stream.size())}},
       "look whether a list or the recording is cut off"});
}

/** Index of each image by what tells it apart. */
std::map<Parts, std::size_t>
byParts(const std::vector<Parts>& parts)
{
  std::map<Parts, std::size_t> result;
  for (std::size_t i = 0; i < parts.size(); ++i)
    result.emplace(parts[i], i);
  return result;
}

/** Two counters that run apart show themselves: images without a partner at opposite ends. */
void
sayNames(std::size_t num_color, std::size_t num_depth, Recording& recording,
         const std::vector<std::ptrdiff_t>& shifts)
{
  const std::size_t frames = recording.frames.size();
  const bool is_shifted =
      frames >= 2 && num_color == num_depth && frames < num_color && shifts.front() != 0 &&
      std::count(shifts.begin(), shifts.end(), shifts.front()) == std::ptrdiff_t(shifts.size());
  Finding finding{Severity::NOTE,
                  "pairing",
                  "colour and depth images are paired by the number that differs in their names: " +
                      std::to_string(frames) + " frames of " + std::to_string(num_color) +
                      " colour and " + std::to_string(num_depth) + " depth images",
                  {{"frames", double(frames)},
                   {"color_images", double(num_color)},
                   {"depth_images", double(num_depth)}},
                  ""};
  if (is_shifted) {
    finding.severity = Severity::FAULT;
    const std::size_t apart = std::size_t(std::abs(shifts.front()));
    finding.what += ", but both streams have equally many images and their numbers are " +
                    std::to_string(apart) +
                    " apart: they are likely two counters, and equal numbers do not mean the same "
                    "moment";
    finding.evidence.emplace_back("counters_apart", double(apart));
    finding.remedy = "name the images by their time, or give those of one moment one number";
  }
  recording.findings.push_back(finding);
}

} // namespace

bool
isImageName(const std::string& name)
{
  static const std::set<std::string> extensions = {".png",  ".jpg", ".jpeg", ".bmp", ".tif",
                                                   ".tiff", ".pgm", ".ppm",  ".pnm", ".exr"};
  const std::string extension = boost::filesystem::path(name).extension().string();
  return extensions.count(boost::to_lower_copy(extension)) && name.front() != '.';
}

Stream
listImages(const std::string& folder)
{
  return listFiles(folder, isImageName);
}

Stream
listFiles(const std::string& folder, bool (*fits)(const std::string&))
{
  Stream images;
  for (const boost::filesystem::directory_entry& entry :
       boost::filesystem::directory_iterator(folder))
    if (fits(entry.path().filename().string()))
      images.push_back({0, 0, entry.path().string()});
  if (images.empty())
    throw IOException(folder + ": the folder holds no image");
  const std::vector<std::vector<std::string>> parts = distinguishingParts(stemsOf(images));
  std::vector<std::size_t> order(images.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return comesBefore(parts[a], parts[b]); });
  Stream sorted;
  for (const std::size_t i : order)
    sorted.push_back(images[i]);
  return sorted;
}

std::vector<std::string>
stemsOf(const Stream& stream)
{
  std::vector<std::string> stems;
  for (const StreamImage& image : stream)
    stems.push_back(boost::filesystem::path(image.file).stem().string());
  return stems;
}

bool
namesRise(const Stream& stream)
{
  const std::vector<Parts> parts = distinguishingParts(stemsOf(stream));
  std::size_t same = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!isNumber(parts[i].back()) || (i > 0 && !comesBefore(parts[i - 1], parts[i])))
      return false;
    same += std::abs(numberOf(parts[i].back()) - stream[i].timestamp) < 1e-3;
  }
  return 2 * same < parts.size();
}

void
pairByTime(const Stream& color, const Stream& depth, double max_difference,
           const std::string& folder, Recording& recording)
{
  const auto pairs = associate(stampsOf(color), stampsOf(depth), max_difference);
  if (pairs.empty())
    refuseWithoutOverlap(color, depth, max_difference, folder);
  std::vector<char> color_used(color.size()), depth_used(depth.size());
  std::vector<double> differences;
  for (const auto& [i, j] : pairs) {
    recording.frames.push_back({color[i].number, color[i].timestamp, color[i].file, depth[j].file});
    color_used[i] = depth_used[j] = 1;
    differences.push_back(std::abs(color[i].timestamp - depth[j].timestamp));
  }
  const std::string within = " image within " + shortText(max_difference, 6) + " s";
  for (std::size_t i = 0; i < color.size(); ++i)
    if (!color_used[i])
      recording.skipped.push_back({color[i].file, "no depth" + within});
  for (std::size_t j = 0; j < depth.size(); ++j)
    if (!depth_used[j])
      recording.skipped.push_back({depth[j].file, "no colour" + within});
  sayTimes(color, depth, max_difference, recording, differences);
  sayIfCutOff("colour", color, depth, max_difference, recording);
  sayIfCutOff("depth", depth, color, max_difference, recording);
}

void
pairByName(const Stream& color, const Stream& depth, const std::string& folder,
           Recording& recording)
{
  const std::vector<Parts> color_parts = distinguishingParts(stemsOf(color));
  const std::vector<Parts> depth_parts = distinguishingParts(stemsOf(depth));
  const auto numbered_color = byParts(color_parts), numbered_depth = byParts(depth_parts);
  std::vector<std::size_t> order(color.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return comesBefore(color_parts[a], color_parts[b]);
  });
  std::vector<std::ptrdiff_t> shifts;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const StreamImage& image = color[order[i]];
    const auto partner = numbered_depth.find(color_parts[order[i]]);
    if (partner == numbered_depth.end()) {
      recording.skipped.push_back({image.file, "has no depth image of its number"});
      continue;
    }
    const std::size_t j = partner->second;
    recording.frames.push_back({image.number, image.timestamp, image.file, depth[j].file});
    shifts.push_back(std::ptrdiff_t(j) - std::ptrdiff_t(order[i]));
  }
  for (std::size_t j = 0; j < depth.size(); ++j)
    if (numbered_color.count(depth_parts[j]) == 0)
      recording.skipped.push_back({depth[j].file, "has no colour image of its number"});
  if (recording.frames.empty())
    throw IOException(folder +
                      ": no colour image has a depth image of its number: the names "
                      "of " +
                      std::to_string(color.size()) + " colour and " + std::to_string(depth.size()) +
                      " depth images do not say which belong together");
  sayNames(color.size(), depth.size(), recording, shifts);
}

} // namespace bundle_icp
