// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/calibration_files.h"

#include "io/recordings/name_numbers.h"
#include "io/recordings/pairing.h"
#include "io/recordings/time_stamps.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/algorithm/string.hpp>
#include <boost/filesystem.hpp>

#include <set>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

// The lists that name both images of a frame in a line.
constexpr const char* ASSOCIATION_NAMES[] = {"associations.txt", "association.txt", "associate.txt",
                                             "associated.txt"};

// The ending of ICL-NUIM's files of true poses.
constexpr const char* ICL_NUIM_POSES = ".gt.freiburg";

std::string
associationList(const std::string& folder)
{
  for (const char* const name : ASSOCIATION_NAMES)
    if (fs::is_regular_file(fs::path(folder) / name))
      return (fs::path(folder) / name).string();
  return {};
}

// The file that words of a line name: names may hold blanks, and Windows' separators.
std::string
listedFile(const std::string& folder, const std::vector<std::string>& words)
{
  const fs::path whole = fs::path(folder) / boost::algorithm::join(words, " "),
                 first = fs::path(folder) / words[0];
  const fs::path& file = fs::exists(whole) || !fs::exists(first) ? whole : first;
  if (fs::exists(file))
    return file.string();
  const fs::path replaced = boost::algorithm::replace_all_copy(file.string(), "\\", "/");
  return (fs::exists(replaced) ? replaced : file).string();
}

// The images of rgb.txt or depth.txt that exist. Absent ones are left out before
// association, so that an image whose closest partner is absent can take the next one.
Stream
readList(const std::string& folder, const std::string& name, Recording& recording)
{
  const std::string path = (fs::path(folder) / name).string();
  Stream images;
  std::set<std::pair<double, std::string>> seen;
  std::size_t number = 0;
  for (const TextLine& line : readTextLines(path)) {
    if (line.words.size() < 2)
      throw IOException(path + ":" + std::to_string(line.number) +
                        ": expected a time stamp and a file name");
    const double timestamp = parseNumbers({line.number, {line.words[0]}}, path).front();
    const std::string file = listedFile(folder, {line.words.begin() + 1, line.words.end()});
    if (!fs::exists(file))
      recording.skipped.push_back({file, "listed in " + name + " but absent"});
    else if (seen.emplace(timestamp, file).second)
      images.push_back({number, timestamp, file});
    ++number;
  }
  if (images.empty())
    throw IOException(
        path + (number == 0 ? ": lists no image"
                            : ": none of the " + std::to_string(number) + " listed images exists"));
  return images;
}

// Names that are times, as TUM's are, and other times in the list contradict each other.
void
compareWithNames(const Stream& images, const std::string& list, Recording& recording)
{
  constexpr double same = 1e-4, most = 0.5;
  std::vector<std::string> named, others;
  const std::vector<std::string> stems = stemsOf(images);
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (!isNumber(stems[i]))
      return;
    const bool is_same = std::abs(numberOf(stems[i]) - images[i].timestamp) < same;
    (is_same ? named : others).push_back(images[i].file);
  }
  if (others.empty() || double(named.size()) < most * double(images.size()))
    return;
  recording.findings.push_back(
      {Severity::WARNING,
       "time_stamps",
       list + " gives " + std::to_string(others.size()) + " of " + std::to_string(images.size()) +
           " images another time than their names do, for example " + others.front(),
       {{"images", double(others.size())}},
       "correct the list: it was changed by hand, or is damaged"});
}

// Stamps in seconds, whatever unit they have.
void
convertStamps(Stream& images, const std::string& list, Recording& recording)
{
  std::vector<double> stamps;
  for (const StreamImage& image : images)
    stamps.push_back(image.timestamp);
  const std::optional<TimeUnit> unit = timeUnitOf(stamps);
  const std::string what = unit ? std::string("are in ") + unit->name
                                : "are numbers that tell no unit of time; they count as seconds";
  recording.findings.push_back(
      {Severity::NOTE, "time_stamps", "the time stamps of " + list + " " + what, {}, ""});
  for (StreamImage& image : images)
    image.timestamp *= unit ? unit->seconds : 1;
}

// What is wrong with the stamps of either stream.
std::string
faultOf(const Stream& stream, const std::string& list)
{
  std::vector<double> stamps;
  for (const StreamImage& image : stream)
    stamps.push_back(image.timestamp);
  const std::string fault = faultOfStamps(stamps, namesRise(stream));
  return fault.empty() ? "" : "the time stamps of " + list + " cannot be used: " + fault;
}

// Pairs by time where the stamps serve, else by names, else by order.
void
pairStreams(const Stream& color, const Stream& depth, double max_difference,
            const std::string& folder, Recording& recording)
{
  std::string fault = faultOf(color, "rgb.txt");
  if (fault.empty())
    fault = faultOf(depth, "depth.txt");
  if (fault.empty())
    return pairByTime(color, depth, max_difference, folder, recording);
  recording.is_ordered = false;
  recording.findings.push_back({Severity::WARNING,
                                "time_stamps",
                                fault,
                                {},
                                "nothing is concluded from time; record with true time stamps"});
  try {
    pairByName(color, depth, folder, recording);
  }
  catch (const pcl::IOException& error) {
    throw IOException(messageOf(error) + ", and " + fault);
  }
}

// Where the second stamp of a line stands: the one word from the third on that is a number.
std::size_t
secondStamp(const TextLine& line, const std::string& path)
{
  for (std::size_t i = 2; i + 1 < line.words.size(); ++i)
    if (isNumber(line.words[i]))
      return i;
  throw IOException(path + ":" + std::to_string(line.number) + ": expected TIME IMAGE TIME IMAGE");
}

// A line holds two stamps and two images, in either order; both times may differ.
void
readAssociations(const std::string& path, const std::string& folder, Recording& recording)
{
  Stream color, depth;
  std::size_t number = 0;
  for (const TextLine& line : readTextLines(path)) {
    const auto begin = line.words.begin(), second = begin + std::ptrdiff_t(secondStamp(line, path));
    StreamImage images[2] = {{number, parseNumbers({line.number, {*begin}}, path).front(),
                              listedFile(folder, {begin + 1, second})},
                             {number, parseNumbers({line.number, {*second}}, path).front(),
                              listedFile(folder, {second + 1, line.words.end()})}};
    ++number;
    if (line.words[1].find("depth") != std::string::npos)
      std::swap(images[0], images[1]);
    const bool has_color = fs::exists(images[0].file), has_depth = fs::exists(images[1].file);
    if (has_color && has_depth) {
      color.push_back(images[0]);
      depth.push_back(images[1]);
    }
    else
      recording.skipped.push_back({images[has_color].file, "listed in " + path + " but absent"});
  }
  if (color.empty())
    throw IOException(path + ": names no pair of images that exist");
  convertStamps(color, path, recording);
  for (std::size_t i = 0; i < color.size(); ++i)
    recording.frames.push_back({color[i].number, color[i].timestamp, color[i].file, depth[i].file});
  recording.findings.push_back({Severity::NOTE,
                                "pairing",
                                "colour and depth images are paired as " + path +
                                    " says: " + std::to_string(color.size()) + " frames",
                                {{"frames", double(color.size())}},
                                ""});
  const std::string fault = faultOf(color, path);
  recording.is_ordered = fault.empty();
  if (!fault.empty())
    recording.findings.push_back(
        {Severity::WARNING, "time_stamps", fault, {}, "nothing is concluded from time"});
}

// The calibration of the benchmark's three cameras and of ICL-NUIM, known by the folder's name.
std::optional<CameraIntrinsics>
intrinsicsByName(const std::string& name)
{
  for (const auto& [camera, numbers] :
       {std::make_pair("freiburg1", "517.3,516.5,318.6,255.3,0.2624,-0.9531,-0.0054,0.0026,1.1633"),
        std::make_pair("freiburg2",
                       "520.9,521.0,325.1,249.7,0.2312,-0.7849,-0.0033,-0.0001,0.9172"),
        std::make_pair("freiburg3", "535.4,539.2,320.1,247.6"),
        std::make_pair("_frei_png", "481.2,-480,319.5,239.5")})
    if (name.find(camera) != std::string::npos) {
      CameraIntrinsics intrinsics = parseIntrinsics(numbers);
      intrinsics.width = 640;
      intrinsics.height = 480;
      return intrinsics;
    }
  return std::nullopt;
}

void
findCalibration(const std::string& folder, Recording& recording)
{
  if (readCalibrationFile(folder, recording))
    return;
  // The name that the user typed may be a link or "."; what it stands for counts as
  // well.
  for (const fs::path& path : {fs::absolute(folder).lexically_normal(), fs::canonical(folder)})
    if (!recording.intrinsics)
      recording.intrinsics =
          intrinsicsByName(path.filename_is_dot() ? path.parent_path().filename().string()
                                                  : path.filename().string());
  recording.intrinsics_source = "the folder's name";
}

// The file of true poses; empty when there is none. ICL-NUIM's has the name of its trajectory.
std::string
truthFile(const std::string& folder)
{
  const fs::path usual = fs::path(folder) / "groundtruth.txt";
  if (fs::exists(usual))
    return usual.string();
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (boost::algorithm::ends_with(entry.path().string(), ICL_NUIM_POSES))
      return entry.path().string();
  return {};
}

// ICL-NUIM's images are ordinary ones, but its camera and world have y upwards where ours have it
// downwards: a negative focal length, or the ending of the file of poses, says so. Camera and poses
// are mirrored.
void
turnDown(const std::string& truth, const DatasetOptions& options, Recording& recording)
{
  const auto is_up = [](const std::optional<CameraIntrinsics>& camera) {
    return camera && camera->fy < 0;
  };
  const bool is_negative = is_up(recording.intrinsics) || is_up(options.intrinsics);
  if (!is_negative && !boost::algorithm::ends_with(truth, ICL_NUIM_POSES))
    return;
  recording.is_turned_down = true;
  const Eigen::Vector3d mirror(1, -1, 1);
  for (TimedPose& pose : recording.ground_truth) {
    Eigen::Matrix4d& matrix = pose.world_from_camera.matrix();
    matrix.topRows<3>() = mirror.asDiagonal() * matrix.topRows<3>();
    matrix.leftCols<3>() *= mirror.asDiagonal();
  }
  const std::string what =
      is_negative ? "the focal length fy is negative" : truth + " is a file of ICL-NUIM";
  recording.findings.push_back({Severity::NOTE,
                                "intrinsics",
                                what + ": in the recording's camera y points upwards. The images "
                                       "are used as they are, with a positive fy, and the true "
                                       "poses are mirrored to match",
                                {},
                                ""});
}

} // namespace

bool
isTumFolder(const std::string& folder)
{
  // One is enough: that the other is missing is then said by its name.
  return fs::exists(fs::path(folder) / "rgb.txt") || fs::exists(fs::path(folder) / "depth.txt") ||
         !associationList(folder).empty();
}

Recording
readTumFolder(const std::string& folder, const DatasetOptions& options)
{
  Recording recording;
  recording.format = "TUM RGB-D";
  recording.depth_scale = 5000;
  recording.depth_scale_source = "the format (TUM RGB-D)";
  const std::string list = associationList(folder);
  if (!list.empty() && !fs::exists(fs::path(folder) / "rgb.txt")) {
    readAssociations(list, folder, recording);
  }
  else {
    Stream color = readList(folder, "rgb.txt", recording);
    Stream depth = readList(folder, "depth.txt", recording);
    compareWithNames(color, "rgb.txt", recording);
    compareWithNames(depth, "depth.txt", recording);
    convertStamps(color, "rgb.txt", recording);
    convertStamps(depth, "depth.txt", recording);
    pairStreams(color, depth, options.max_time_difference, folder, recording);
  }
  findCalibration(folder, recording);
  const std::string truth = truthFile(folder);
  if (!truth.empty()) {
    try {
      recording.ground_truth = readTrajectory(truth);
    }
    catch (const pcl::IOException& error) {
      // Frames can be used without their true poses.
      recording.skipped.push_back({truth, messageOf(error)});
    }
  }
  turnDown(truth, options, recording);
  return recording;
}

} // namespace bundle_icp
