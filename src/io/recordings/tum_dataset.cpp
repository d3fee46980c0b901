// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/association.h"
#include "io/recordings/dataset_formats.h"
#include "io/text_file.h"

#include <pcl/exceptions.h>

#include <boost/filesystem.hpp>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

struct ListedImage {
  std::size_t number = 0; // among the lines of the list, from 0
  double timestamp = 0;   // [s]
  std::string file;
};

// The images of rgb.txt or depth.txt that exist. Absent ones are left out before
// association, so that an image whose closest partner is absent can take the next one.
std::vector<ListedImage>
readList(const std::string& folder, const std::string& name, Recording& recording)
{
  const std::string path = (fs::path(folder) / name).string();
  std::vector<ListedImage> images;
  std::size_t number = 0;
  for (const TextLine& line : readTextLines(path)) {
    if (line.words.size() < 2)
      throw pcl::IOException(path + ":" + std::to_string(line.number) +
                             ": expected a time stamp and a file name");
    const double timestamp = parseNumbers({line.number, {line.words[0]}}, path).front();
    const std::string file = (fs::path(folder) / line.words[1]).string();
    if (fs::exists(file))
      images.push_back({number, timestamp, file});
    else
      recording.skipped.push_back({file, "listed in " + name + " but absent"});
    ++number;
  }
  if (images.empty())
    throw pcl::IOException(
        path + (number == 0 ? ": lists no image"
                            : ": none of the " + std::to_string(number) + " listed images exists"));
  return images;
}

std::vector<double>
stamps(const std::vector<ListedImage>& images)
{
  std::vector<double> result;
  for (const ListedImage& image : images)
    result.push_back(image.timestamp);
  return result;
}

std::string
timeSpan(std::vector<double> times)
{
  const auto [first, last] = std::minmax_element(times.begin(), times.end());
  return std::to_string(*first) + " to " + std::to_string(*last) + " s";
}

void
associateImages(const std::vector<ListedImage>& color, const std::vector<ListedImage>& depth,
                double max_difference, const std::string& folder, Recording& recording)
{
  const auto pairs = associate(stamps(color), stamps(depth), max_difference);
  if (pairs.empty())
    throw pcl::IOException(folder + ": no overlap in time: colour images span " +
                           timeSpan(stamps(color)) + ", depth images " + timeSpan(stamps(depth)) +
                           ", and none lie within " + std::to_string(max_difference) +
                           " s of each other");
  std::vector<char> color_used(color.size()), depth_used(depth.size());
  for (const auto& [i, j] : pairs) {
    recording.frames.push_back({color[i].number, color[i].timestamp, color[i].file, depth[j].file});
    color_used[i] = depth_used[j] = 1;
  }
  const std::string within = " image within " + std::to_string(max_difference) + " s";
  for (std::size_t i = 0; i < color.size(); ++i)
    if (!color_used[i])
      recording.skipped.push_back({color[i].file, "no depth" + within});
  for (std::size_t j = 0; j < depth.size(); ++j)
    if (!depth_used[j])
      recording.skipped.push_back({depth[j].file, "no colour" + within});
}

// The benchmark's own calibration of its three cameras, known by the folder's name.
std::optional<CameraIntrinsics>
intrinsicsByName(const std::string& name)
{
  for (const auto& [camera, numbers] :
       {std::make_pair("freiburg1", "517.3,516.5,318.6,255.3,0.2624,-0.9531,-0.0054,0.0026,1.1633"),
        std::make_pair("freiburg2",
                       "520.9,521.0,325.1,249.7,0.2312,-0.7849,-0.0033,-0.0001,0.9172"),
        std::make_pair("freiburg3", "535.4,539.2,320.1,247.6")})
    if (name.find(camera) != std::string::npos) {
      CameraIntrinsics intrinsics = parseIntrinsics(numbers);
      intrinsics.width = 640;
      intrinsics.height = 480;
      return intrinsics;
    }
  return std::nullopt;
}

// `intrinsics.txt`: a line `fx fy cx cy [k1 k2 p1 p2 k3]`, optionally one `depth_scale
// 5000`.
void
readIntrinsicsFile(const std::string& path, Recording& recording)
{
  for (TextLine line : readTextLines(path)) {
    const bool is_scale = line.words[0] == "depth_scale";
    if (is_scale)
      line.words.erase(line.words.begin());
    const std::vector<double> values = parseNumbers(line, path);
    if (is_scale && values.size() == 1 && values[0] > 0) {
      recording.depth_scale = values[0];
    }
    else if (!is_scale && (values.size() == 4 || values.size() == 9)) {
      std::string text;
      for (const std::string& word : line.words)
        text += word + " ";
      recording.intrinsics = parseIntrinsics(text);
    }
    else
      throw pcl::IOException(path + ":" + std::to_string(line.number) +
                             ": expected fx fy cx cy [k1 k2 p1 p2 k3] or depth_scale "
                             "UNITS_PER_METRE");
  }
  recording.intrinsics_source = path;
}

void
findCalibration(const std::string& folder, Recording& recording)
{
  const fs::path file = fs::path(folder) / "intrinsics.txt";
  if (fs::exists(file))
    return readIntrinsicsFile(file.string(), recording);
  // The name that the user typed may be a link or "."; what it stands for counts as
  // well.
  for (const fs::path& path : {fs::absolute(folder).lexically_normal(), fs::canonical(folder)})
    if (!recording.intrinsics)
      recording.intrinsics =
          intrinsicsByName(path.filename_is_dot() ? path.parent_path().filename().string()
                                                  : path.filename().string());
  recording.intrinsics_source = "the folder's name";
}

} // namespace

bool
isTumFolder(const std::string& folder)
{
  // One is enough: that the other is missing is then said by its name.
  return fs::exists(fs::path(folder) / "rgb.txt") || fs::exists(fs::path(folder) / "depth.txt");
}

Recording
readTumFolder(const std::string& folder, double max_time_difference)
{
  Recording recording;
  recording.format = "TUM RGB-D";
  recording.depth_scale = 5000;
  const std::vector<ListedImage> color = readList(folder, "rgb.txt", recording);
  const std::vector<ListedImage> depth = readList(folder, "depth.txt", recording);
  associateImages(color, depth, max_time_difference, folder, recording);
  findCalibration(folder, recording);
  const std::string truth = (fs::path(folder) / "groundtruth.txt").string();
  if (fs::exists(truth)) {
    try {
      recording.ground_truth = readTrajectory(truth);
    }
    catch (const pcl::IOException& error) {
      // Frames can be used without their true poses.
      recording.skipped.push_back({truth, messageOf(error)});
    }
  }
  return recording;
}

} // namespace bundle_icp
