// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/scan/check.h>

#include "common/by_time.h"
#include "common/parallel.h"
#include "refinement/format_text.h"
#include "refinement/spread.h"
#include "scan/check_repetitions.h"
#include "scan/check_together.h"
#include "scan/read_frame.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

std::string
text(double value, int digits = 3)
{
  return formatText("%.*g", digits, value);
}

/** Three runs of frames at the beginning, in the middle and at the end, at most a fifth of a
 *  second from one to the next: they show all of the recording, and what neighbours share. */
FrameSample
takeSample(const RGBDDataset& dataset, const CheckOptions& options)
{
  const std::vector<std::size_t> order = byTime(dataset);
  const double pixels = double(dataset.camera().width) * dataset.camera().height;
  const std::size_t number = std::min(
      order.size(),
      std::max<std::size_t>(3, std::size_t(double(options.num_frames) *
                                           std::min(1.0, 307200 / std::max(1.0, pixels)))));
  const double span = dataset.timestamp(order.back()) - dataset.timestamp(order.front());
  const double interval = span / double(std::max<std::size_t>(1, order.size() - 1));
  const std::size_t most = order.size() / number;
  const std::size_t step =
      std::clamp<std::size_t>(interval > 0 ? std::size_t(std::min(1e6, 0.2 / interval)) : 1, 1,
                              std::max<std::size_t>(1, most));
  FrameSample sample;
  sample.order = order;
  sample.step = step;
  const std::size_t num_runs = number == order.size() ? 1 : std::min<std::size_t>(3, number);
  for (std::size_t run = 0; run < num_runs; ++run) {
    const std::size_t length = number * (run + 1) / num_runs - number * run / num_runs;
    const std::size_t free = order.size() - ((length - 1) * step + 1);
    const std::size_t begin = num_runs == 1 ? 0 : free * run / (num_runs - 1);
    for (std::size_t i = 0; i < length; ++i)
      sample.places.push_back(begin + i * step);
  }
  for (const std::size_t place : sample.places)
    sample.frames.push_back(order[place]);
  sample.pixels_per_edge_pixel = std::max(1.0, double(dataset.camera().width) / EDGE_WIDTH);
  sample.looks.resize(sample.frames.size());
  parallelFor(sample.frames.size(), options.num_threads, {}, [&](std::size_t i) {
    try {
      sample.looks[i] = lookAt(readFrame(dataset, sample.frames[i]), dataset.camera());
    }
    catch (const pcl::IOException&) {
      // An image that cannot be read is reported by the reconstruction, with its name.
    }
  });
  return sample;
}

void
checkCamera(const CameraIntrinsics& camera, std::vector<Finding>& findings)
{
  const double dx = std::abs(camera.cx - 0.5 * (camera.width - 1)) / camera.width;
  const double dy = std::abs(camera.cy - 0.5 * (camera.height - 1)) / camera.height;
  const double view = 2 * std::atan(camera.width / (2 * camera.fx)) * 180 / M_PI;
  const bool is_half = std::abs(2 * camera.cx / camera.width - 0.5) < 0.08 &&
                       std::abs(2 * camera.cy / camera.height - 0.5) < 0.08;
  const std::string size = std::to_string(camera.width) + "x" + std::to_string(camera.height);
  if (dx > 0.12 || dy > 0.12)
    findings.push_back(
        {Severity::FAULT,
         "intrinsics",
         "the principal point " + text(camera.cx, 4) + ", " + text(camera.cy, 4) +
             " px lies far from the centre of the images of " + size +
             (is_half ? ": the intrinsics are likely those of images of half the size" : ""),
         {{"offset_x_share", dx}, {"offset_y_share", dy}},
         is_half ? "double them with --intrinsics"
                 : "give the intrinsics of images of this size with --intrinsics"});
  if (view < 25 || view > 125)
    findings.push_back({Severity::WARNING,
                        "intrinsics",
                        "a focal length of " + text(camera.fx, 4) + " px in images of " + size +
                            " is a field of view of " + text(view) +
                            " degrees, which no common depth camera has",
                        {{"field_of_view_deg", view}},
                        "give the intrinsics of images of this size with --intrinsics"});
  if (std::abs(camera.fx / camera.fy - 1) > 0.1)
    findings.push_back({Severity::WARNING,
                        "intrinsics",
                        "fx " + text(camera.fx, 4) + " px and fy " + text(camera.fy, 4) +
                            " px differ by more than a tenth, but pixels are square",
                        {{"fx_over_fy", camera.fx / camera.fy}},
                        "check whether the images were scaled; see --intrinsics"});
}

/** The units that would put the depth into a room. */
std::string
likelyUnit(double depth)
{
  const std::pair<double, const char*> factors[] = {
      {10, "ten times as many units per metre, such as 10000 for 0.1 mm"},
      {5, "five times as many units per metre, such as TUM's 5000"},
      {1000, "a thousand times as many units per metre"},
      {0.1, "a tenth of the units per metre"},
      {0.2, "a fifth of the units per metre"},
      {0.001, "a thousandth of the units per metre"}};
  std::string units;
  for (const auto& [factor, name] : factors)
    if (depth / factor > 0.4 && depth / factor < 4)
      units += (units.empty() ? "" : ", or ") + std::string(name);
  return units.empty() ? "another unit" : units;
}

/** Depths between which a scene lies that a sensor measures well, from the makers' data sheets [m]:
 *  Kinect, Xtion and Astra from 0.35 to 0.4 m on; D405 0.07, others of its series more; Azure
 *  Kinect and L515 0.25, and farther than the others. The largest median depth. */
struct SensorRange {
  double nearest, farthest_median;
};

SensorRange
rangeOf(const std::string& sensor)
{
  if (sensor == "kinect")
    return {0.3, 4};
  return sensor == "tof" || sensor == "lidar" ? SensorRange{0.2, 6} : SensorRange{0.05, 5};
}

void
checkUnits(const FrameSample& sample, const DepthNoise& noise, std::vector<Finding>& findings)
{
  std::vector<double> depths, nearest, farthest;
  for (const FrameLook& look : sample.looks)
    if (look.median_depth > 0) {
      depths.push_back(look.median_depth);
      nearest.push_back(look.near_depth);
      farthest.push_back(look.far_depth);
    }
  if (depths.empty()) {
    findings.push_back({Severity::FAULT,
                        "units",
                        "none of the " + std::to_string(sample.looks.size()) +
                            " frames that were looked at has depth",
                        {},
                        "check the depth images"});
    return;
  }
  // What is held before the camera may be nearer than its sensor measures; a whole scene is not.
  constexpr double smallest_scene = 1, farthest_scene = 10; // nine tenths of the depth [m]
  const double depth = medianOf(depths), near = medianOf(nearest), far = medianOf(farthest);
  const std::string sensor = sensorName(noise);
  const SensorRange range = rangeOf(sensor);
  const bool is_room = depth >= 0.2 && depth <= range.farthest_median && far <= farthest_scene;
  const bool is_seen = near >= range.nearest || far > smallest_scene;
  findings.push_back({is_room && is_seen ? Severity::NOTE : Severity::FAULT,
                      "units",
                      "the median depth is " + text(depth) + " m" +
                          (!is_room ? " and a tenth is farther than " + text(far) +
                                          " m, which is no room's: likely a wrong unit"
                           : !is_seen ? ", most lies between " + text(near) + " and " + text(far) +
                                            " m, partly too near for the sensor (" + sensor +
                                            "): likely a wrong unit"
                                      : ""),
                      {{"median_depth_m", depth}, {"near_depth_m", near}, {"far_depth_m", far}},
                      is_room && is_seen
                          ? ""
                          : "--depth-scale sets the units per metre: " + likelyUnit(depth) +
                                (is_room ? "; --sensor if another sensor took it" : "")});
}

void
checkFrames(const FrameSample& sample, std::vector<Finding>& findings)
{
  std::vector<double> sharpness;
  for (const FrameLook& look : sample.looks)
    if (look.is_read && look.brightness >= 8)
      sharpness.push_back(look.sharpness);
  const double usual = medianOf(sharpness), number = double(sample.looks.size());
  const auto say = [&](const char* what, const std::string& name, const auto& has) {
    const double count = double(std::count_if(sample.looks.begin(), sample.looks.end(), has));
    const double share = count / number;
    if (count > 0)
      findings.push_back(
          {share > 0.5 ? Severity::WARNING : Severity::NOTE,
           "frames",
           text(count, 6) + " of " + text(number, 6) + " frames that were looked at " + what,
           {{name + "_share", share}},
           ""});
  };
  say("cannot be read", "unreadable", [](const FrameLook& look) { return !look.is_read; });
  say("are dark", "dark",
      [](const FrameLook& look) { return look.is_read && look.brightness < 8; });
  say("have next to no depth", "empty",
      [](const FrameLook& look) { return look.is_read && look.measured < 0.02; });
  say("have blurred colour", "blurred", [&](const FrameLook& look) {
    return look.is_read && look.brightness >= 8 && look.sharpness < 0.4 * usual;
  });
}

/** Times from a frame to the next [s]; empty where stamps do not tell them. */
std::vector<double>
stepsInTime(const RGBDDataset& dataset, const std::vector<std::size_t>& order)
{
  std::vector<double> steps;
  if (dataset.isOrdered() && dataset.hasTimes())
    for (std::size_t i = 1; i < order.size(); ++i)
      steps.push_back(dataset.timestamp(order[i]) - dataset.timestamp(order[i - 1]));
  return steps;
}

void
checkGaps(const std::vector<double>& steps, std::vector<Finding>& findings)
{
  if (steps.size() < 2)
    return;
  const double usual = medianOf(steps), longest = *std::max_element(steps.begin(), steps.end());
  const auto gaps = std::count_if(steps.begin(), steps.end(),
                                  [&](double step) { return step > 10 * usual && step > 1; });
  if (usual > 0 && gaps > 0)
    findings.push_back({Severity::NOTE,
                        "time_stamps",
                        "time has " + std::to_string(gaps) + " gaps, the longest of " +
                            text(longest) + " s, where frames are usually " + text(usual) +
                            " s apart",
                        {{"gaps", double(gaps)}, {"longest_gap_s", longest}},
                        ""});
}

/** What a reconstruction with surface will take: measured on recordings of 24 to 792 frames of
 *  640x480 on two cores, where both grow with the number of pixels. */
void
predictResources(const RGBDDataset& dataset, std::vector<Finding>& findings)
{
  constexpr double seconds_per_megapixel = 0.9, memory = 0.12, memory_per_megapixel = 0.0045;
  const double megapixels =
      1e-6 * double(dataset.size()) * dataset.camera().width * double(dataset.camera().height);
  const double seconds = seconds_per_megapixel * megapixels;
  const double gigabytes = memory + memory_per_megapixel * megapixels;
  findings.push_back(
      {Severity::NOTE,
       "resources",
       "the reconstruction of " + std::to_string(dataset.size()) + " frames will take about " +
           (seconds < 90 ? text(seconds, 1) + " s" : text(seconds / 60, 2) + " min") +
           " of processor time and " + text(gigabytes, 2) + " GB of memory",
       {{"processor_time_s", seconds}, {"memory_gb", gigabytes}},
       ""});
}

} // namespace

bool
CheckOptions::isValid(std::string* error) const
{
  const bool is_valid = num_frames >= 2 && num_frames <= 1000 && num_threads >= 0;
  if (!is_valid && error)
    *error = "frames to look at must be 2 to 1000, threads at least 0";
  return is_valid;
}

std::vector<Finding>
checkRecording(const RGBDDataset& dataset, const CheckOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("checkRecording: " + error);
  if (dataset.size() == 0)
    throw BadArgumentException("checkRecording: the recording has no frame");
  std::vector<Finding> findings = dataset.findings();
  const FrameSample sample = takeSample(dataset, options);
  checkCamera(dataset.camera(), findings);
  checkUnits(sample, dataset.camera().depth_noise, findings);
  std::vector<DepthNumbers> numbers;
  for (const FrameLook& look : sample.looks)
    numbers.push_back(look.numbers);
  checkNumbers(numbers, shareOfDifferentViews(sample), findings);
  const std::vector<double> steps = stepsInTime(dataset, sample.order);
  checkTogether(sample, medianOf(steps), options.num_threads, findings);
  checkRepetitions(dataset, sample, options.num_threads, findings);
  checkFrames(sample, findings);
  checkGaps(steps, findings);
  predictResources(dataset, findings);
  return findings;
}

} // namespace bundle_icp
