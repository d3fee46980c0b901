// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "recording.h"

#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <boost/filesystem.hpp>
#include <opencv2/imgcodecs.hpp>

#include <cstdio>
#include <mutex>

namespace adversity {
namespace {

using namespace bundle_icp;
using Options = SyntheticScanOptions;

/** Frames of a simulated scan. */
constexpr std::size_t NUM_FRAMES = 24;

std::string
numbered(std::size_t number)
{
  char text[32];
  std::snprintf(text, sizeof(text), "%04zu", number);
  return text;
}

Recording
simulate(const Options& options)
{
  const SyntheticScan scan(options);
  Recording recording;
  recording.camera = scan.camera();
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const RGBDFrame frame = scan.read(i);
    cv::Mat metres = frame.depth.clone(), units;
    metres.setTo(0, metres != metres);
    metres.convertTo(units, CV_16UC1, recording.depth_scale);
    // A clock that did not start with the recording.
    const double time = 1000 + scan.timestamp(i);
    const Eigen::Vector3d place = scan.worldFromCamera(i).translation();
    recording.color.push_back({frame.color, time, numbered(i), place});
    recording.depth.push_back({units, time, numbered(i), place});
  }
  return recording;
}

/** Objects on a table, 640x480, with all the noise of a common camera. */
Options
tableOptions()
{
  Options options = Options::fullNoise();
  options.num_frames = NUM_FRAMES;
  options.seed = 1;
  return options;
}

/** Walls, another seed, 320x240. */
Options
wallsOptions()
{
  Options options = tableOptions();
  options.seed = 2;
  options.start_time = 67;
  options.width = 320;
  options.height = 240;
  options.focal_length = 262.5;
  return options;
}

/** Where a person walks by, if there is one. */
Options
passageOptions()
{
  Options options = tableOptions();
  options.start_time = 18;
  return options;
}

Options
smallPassageOptions()
{
  Options options = wallsOptions();
  options.seed = 3;
  options.start_time = 42.5;
  return options;
}

template <class Change>
Recording
simulateWith(Options options, const Change& change)
{
  change(options);
  return simulate(options);
}

/** Position at a time, from the two true poses around it. */
Eigen::Vector3d
placeAt(const Trajectory& truth, double time)
{
  std::size_t next = 1;
  while (next + 1 < truth.size() && truth[next].timestamp < time)
    ++next;
  const TimedPose &a = truth[next - 1], &b = truth[next];
  const double share = (time - a.timestamp) / (b.timestamp - a.timestamp);
  return (1 - share) * a.world_from_camera.translation() +
         share * b.world_from_camera.translation();
}

/** Every `step`-th frame of a shared recording, from frame `first` on. */
Recording
shared(const std::string& name, std::size_t first, std::size_t step, double depth_scale)
{
  namespace fs = boost::filesystem;
  const std::string folder = std::string(BUNDLE_ICP_TEST_DATA) + "/" + name;
  Recording recording;
  if (!fs::is_directory(folder))
    return recording;
  const auto dataset = openDataset(folder);
  const Trajectory truth = dataset->groundTruth();
  recording.camera = dataset->camera();
  recording.depth_scale = depth_scale;
  for (std::size_t k = 0; k < NUM_FRAMES; ++k) {
    const std::size_t i = first + k * step;
    // The reader removes distortion and aligns colour with depth: what is written needs no lens.
    const RGBDFrame frame = dataset->read(i);
    cv::Mat metres = frame.depth.clone(), units;
    metres.setTo(0, metres != metres);
    metres.convertTo(units, CV_16UC1, depth_scale);
    const double time = dataset->timestamp(i);
    const Eigen::Vector3d place = placeAt(truth, time);
    recording.color.push_back({frame.color, time, numbered(k), place});
    recording.depth.push_back({units, time, numbered(k), place});
  }
  return recording;
}

struct Base {
  std::function<Recording()> make;
  std::string reference; ///< empty: itself
};

const std::map<std::string, Base>&
bases()
{
  const auto with = [](Options options, auto change) {
    return [=] { return simulateWith(options, change); };
  };
  static const std::map<std::string, Base> result = {
      {"table", {[] { return simulate(tableOptions()); }, ""}},
      {"walls", {[] { return simulate(wallsOptions()); }, ""}},
      {"desk", {[] { return shared("freiburg1_xyz_10hz", 10, 2, 5000); }, ""}},
      {"kitchen", {[] { return shared("redkitchen_every4", 0, 1, 5000); }, ""}},
      {"flat", {[] { return shared("replica_walk_a", 0, 1, 5000); }, ""}},
      {"other_table", {with(tableOptions(), [](Options& o) { o.seed = 9; }), ""}},
      {"half_late", {with(tableOptions(), [](Options& o) { o.time_offset = 0.05; }), "table"}},
      {"plain", {with(tableOptions(), [](Options& o) { o.texture = 0; }), "table"}},
      {"holes", {with(tableOptions(), [](Options& o) { o.hole_fraction = 0.5; }), "table"}},
      {"blurred", {with(tableOptions(), [](Options& o) { o.blur_fraction = 0.6; }), "table"}},
      {"unsteady_light",
       {with(tableOptions(), [](Options& o) { o.exposure_change = 0.6; }), "table"}},
      {"turning", {with(tableOptions(), [](Options& o) { o.movement = 0; }), ""}},
      {"gripper", {with(tableOptions(), [](Options& o) { o.gripper = true; }), "table"}},
      {"slow", {with(tableOptions(), [](Options& o) { o.frame_rate = 4; }), ""}},
      {"passage", {[] { return simulate(passageOptions()); }, ""}},
      {"person", {with(passageOptions(), [](Options& o) { o.person = true; }), "passage"}},
      {"small_passage", {[] { return simulate(smallPassageOptions()); }, ""}},
      {"small_person",
       {with(smallPassageOptions(), [](Options& o) { o.person = true; }), "small_passage"}},
  };
  return result;
}

} // namespace

const Recording&
baseRecording(const std::string& name)
{
  static std::map<std::string, Recording> made;
  static std::mutex mutex;
  const std::lock_guard<std::mutex> lock(mutex);
  const auto known = made.find(name);
  return known != made.end() ? known->second
                             : made.emplace(name, bases().at(name).make()).first->second;
}

std::string
referenceOf(const std::string& base)
{
  const std::string& reference = bases().at(base).reference;
  return reference.empty() ? base : reference;
}

} // namespace adversity
