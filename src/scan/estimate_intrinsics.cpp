// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/scan/estimate_intrinsics.h>

#include "common/by_time.h"
#include "common/parallel.h"
#include "refinement/focal_length.h"
#include "refinement/format_text.h"
#include "scan/read_frame.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Frames are taken in runs of so many, at most so far apart [s]: a hand turns a camera by some ten
 *  degrees in that time, and both frames still see the same things. */
constexpr std::size_t RUN_LENGTH = 8;
constexpr double RUN_STEP = 0.5;
/** Poses hardly suffer from a focal length of a smaller deviation, as a share of it. */
constexpr double EXACT = 0.01;

CameraIntrinsics
startCamera(const CameraIntrinsics& recorded, double field_of_view)
{
  CameraIntrinsics camera;
  camera.width = recorded.width;
  camera.height = recorded.height;
  camera.fx = camera.fy = 0.5 * camera.width / std::tan(0.5 * field_of_view);
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  camera.depth_noise = recorded.depth_noise;
  return camera;
}

/** Runs of frames, in the order of time, with steps that let neighbours overlap. */
std::vector<std::size_t>
sampleFrames(const RGBDDataset& dataset, std::size_t num_frames)
{
  const std::vector<std::size_t> order = byTime(dataset);
  const std::size_t count = std::min(num_frames, order.size());
  const std::size_t length = std::min(RUN_LENGTH, count), runs = count / length;
  const double span = dataset.timestamp(order.back()) - dataset.timestamp(order.front());
  const double interval = span / std::max(1.0, double(order.size() - 1));
  const std::size_t even = order.size() / count;
  const std::size_t step = dataset.isOrdered() && interval > 0 && even * interval > RUN_STEP
                               ? std::max<std::size_t>(1, std::size_t(RUN_STEP / interval))
                               : even;
  std::vector<std::size_t> sample;
  for (std::size_t run = 0; run < runs; ++run)
    for (std::size_t i = 0; i < length; ++i)
      sample.push_back(order[run * order.size() / runs + i * step]);
  return sample;
}

/** Features of these frames; none of those that cannot be read. */
std::vector<Features>
featuresOf(const RGBDDataset& dataset, const std::vector<std::size_t>& frames,
           const CameraIntrinsics& camera, const IntrinsicsEstimateOptions& options)
{
  std::vector<Features> features(frames.size());
  parallelFor(frames.size(), options.num_threads, {}, [&](std::size_t k) {
    try {
      const RGBDFrame frame = readFrame(dataset, frames[k]);
      features[k] = extractFeatures(frame, camera, options.features);
    }
    catch (const pcl::IOException&) { // the reconstruction names it
    }
  });
  return features;
}

/** Before verification, which would keep what fits the camera that is in question. */
std::vector<MatchedFrames>
matchAll(const std::vector<Features>& features, int num_threads)
{
  std::vector<MatchedFrames> pairs;
  for (std::size_t i = 0; i < features.size(); ++i)
    for (std::size_t j = i + 1; j < features.size(); ++j)
      pairs.push_back({i, j, {}});
  parallelFor(pairs.size(), num_threads, {}, [&](std::size_t k) {
    MatchedFrames& pair = pairs[k];
    pair.matches =
        matchDescriptors(features[pair.first].descriptors, features[pair.second].descriptors);
  });
  return pairs;
}

Finding
estimateFinding(const IntrinsicsEstimate& estimate, double start)
{
  const double f = estimate.camera.fx;
  const bool is_exact = estimate.deviation < EXACT * f;
  if (estimate.is_determined)
    return {is_exact ? Severity::NOTE : Severity::WARNING,
            "estimated_intrinsics",
            formatText("the focal length was estimated from %zu pairs of frames: %.1f +- %.1f px, "
                       "with square pixels and the axis in the middle of the image",
                       estimate.num_pairs, f, estimate.deviation),
            {{"estimated_focal_length_px", f},
             {"deviation_px", estimate.deviation},
             {"pairs", double(estimate.num_pairs)}},
            is_exact ? ""
                     : "lengths and poses are only as exact: calibrate the camera and give its "
                       "intrinsics with --intrinsics fx,fy,cx,cy"};
  return {Severity::WARNING,
          "estimated_intrinsics",
          formatText("the data do not determine the focal length (%zu pairs of frames, the camera "
                     "hardly turns between them, or they contradict each other): %.1f px, a field "
                     "of view of %.0f degrees, is assumed",
                     estimate.num_pairs, f, start * 180 / M_PI),
          {{"assumed_focal_length_px", f}, {"pairs", double(estimate.num_pairs)}},
          "give the camera's intrinsics with --intrinsics fx,fy,cx,cy, or turn the camera more"};
}

} // namespace

bool
IntrinsicsEstimateOptions::isValid(std::string* error) const
{
  std::string reason;
  if (!(field_of_view > 0.1 && field_of_view < 2.8))
    reason = "field_of_view must lie in (0.1, 2.8) rad";
  else if (!(lowest > 0 && lowest <= 1 && highest >= 1 && highest <= 10))
    reason = "lowest must lie in (0, 1], highest in [1, 10]";
  else if (num_frames < 2)
    reason = "num_frames must be >= 2";
  else if (num_threads < 0)
    reason = "num_threads must be >= 0";
  else
    features.isValid(&reason);
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

IntrinsicsEstimate
estimateIntrinsics(const RGBDDataset& dataset, const IntrinsicsEstimateOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("estimateIntrinsics: " + error);
  if (dataset.size() == 0)
    throw BadArgumentException("estimateIntrinsics: the recording has no frame");
  IntrinsicsEstimate estimate;
  estimate.camera = startCamera(dataset.camera(), options.field_of_view);
  const std::vector<Features> features =
      featuresOf(dataset, sampleFrames(dataset, options.num_frames), estimate.camera, options);
  const FocalLength focal =
      estimateFocalLength(features, matchAll(features, options.num_threads), estimate.camera,
                          options.lowest, options.highest, options.num_threads);
  estimate.num_pairs = focal.num_pairs;
  estimate.is_determined = focal.is_determined;
  if (focal.is_determined) {
    estimate.camera.fx = estimate.camera.fy = focal.factor * estimate.camera.fx;
    estimate.deviation = focal.deviation * estimate.camera.fx;
  }
  estimate.findings.push_back(estimateFinding(estimate, options.field_of_view));
  return estimate;
}

DatasetOptions
withEstimatedIntrinsics(const std::string& path, DatasetOptions options,
                        const IntrinsicsEstimateOptions& estimate_options)
{
  options.intrinsics.reset();
  options.field_of_view = estimate_options.field_of_view;
  const IntrinsicsEstimate estimate =
      estimateIntrinsics(*openDataset(path, options), estimate_options);
  options.intrinsics = estimate.camera;
  options.intrinsics_source =
      formatText("an estimate that started at a field of view of %.0f degrees",
                 estimate_options.field_of_view * 180 / M_PI);
  options.findings.insert(options.findings.end(), estimate.findings.begin(),
                          estimate.findings.end());
  options.field_of_view.reset();
  return options;
}

RGBDDataset::Ptr
openWithEstimatedIntrinsics(const std::string& path, const DatasetOptions& options,
                            const IntrinsicsEstimateOptions& estimate_options)
{
  return openDataset(path, withEstimatedIntrinsics(path, options, estimate_options));
}

} // namespace bundle_icp
