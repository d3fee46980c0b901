// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/scan_surface.h"

#include "common/left_out.h"
#include "scan/frame_appearance.h"
#include "scan/read_in_order.h"
#include "scan/result_findings.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <numeric>

namespace bundle_icp {

std::vector<std::size_t>
framesToFuse(const ReconstructionResult& result)
{
  std::vector<std::size_t> fused = result.frame_of_node;
  if (!result.graph) {
    fused.resize(result.frames.size());
    std::iota(fused.begin(), fused.end(), 0);
  }
  fused.erase(std::remove_if(fused.begin(), fused.end(),
                             [&result](std::size_t i) { return result.frames[i].component != 0; }),
              fused.end());
  const auto is_doubtful = [&result](std::size_t i) {
    return result.frames[i].verdict == FrameVerdict::DOUBTFUL;
  };
  if (2 * std::count_if(fused.begin(), fused.end(), is_doubtful) < std::ptrdiff_t(fused.size()))
    fused.erase(std::remove_if(fused.begin(), fused.end(), is_doubtful), fused.end());
  return fused;
}

RGBDFrame
frameToFuse(const RGBDDataset& dataset, const ReconstructionResult& result,
            const std::vector<cv::Mat>& moving, std::size_t index, const RGBDFrame& rgbd)
{
  RGBDFrame frame = correctedFrame(rgbd, dataset.camera(), result.model.calibration(),
                                   result.frames[index].depth_error);
  if (index < moving.size() && !moving[index].empty()) {
    cv::Mat mask;
    cv::resize(moving[index], mask, frame.depth.size(), 0, 0, cv::INTER_NEAREST);
    leaveOut(mask, frame.depth);
  }
  return frame;
}

bool
findObject(const RGBDDataset& dataset, const ReconstructionOptions& options,
           const std::vector<cv::Mat>& moving, const ProgressCallback& progress,
           ReconstructionResult& result)
{
  constexpr std::size_t most_frames = 100;
  const std::vector<std::size_t> all = framesToFuse(result);
  std::vector<std::size_t> some;
  for (std::size_t i = 0; i < std::min(most_frames, all.size()); ++i)
    some.push_back(all[i * all.size() / std::min(most_frames, all.size())]);
  const CameraIntrinsics camera = result.model.calibration().corrected(dataset.camera());
  std::vector<pcl::PointCloud<pcl::PointXYZ>> clouds;
  std::vector<Pose> poses;
  std::size_t done = 0;
  const bool completed = readInOrder(
      dataset, some, options.num_threads,
      [&](std::size_t index, const RGBDFrame& rgbd, const std::string& error) {
        if (error.empty()) { // one that cannot be read is named when it is to be fused
          constexpr int step = 6;
          clouds.push_back(samplePoints(rgbd, camera, step));
          poses.push_back(result.frames[index].world_from_depth);
        }
        return !progress || progress({"object", ++done, some.size()});
      },
      [&](std::size_t index, const RGBDFrame& rgbd) {
        return frameToFuse(dataset, result, moving, index, rgbd);
      });
  if (!completed)
    return false;
  result.object.emplace();
  result.object->reason = "no object: no frame could be read again";
  if (!clouds.empty())
    result.object = findObjectRegion(clouds, poses, *options.object);
  return true;
}

bool
fuseSurface(const RGBDDataset& dataset, const ReconstructionOptions& options,
            const std::vector<cv::Mat>& moving, const ProgressCallback& progress,
            ReconstructionResult& result)
{
  const std::vector<std::size_t> fused = framesToFuse(result);
  const CameraIntrinsics camera = result.model.calibration().corrected(dataset.camera());
  TSDFOptions volume_options = options.volume;
  if (result.object)
    volume_options.region = result.object->box;
  TSDFVolume volume(volume_options);
  std::vector<ColorCorrection> corrections(result.frames.size());
  if (result.graph) {
    const auto of_node = colorCorrections(*result.graph, result.model);
    for (std::size_t node = 0; node < of_node.size(); ++node)
      corrections[result.frame_of_node[node]] = of_node[node];
  }
  std::size_t done = 0;
  const auto fuse = [&](std::size_t index, const RGBDFrame& rgbd, const std::string& error) {
    FrameReport& frame = result.frames[index];
    // One that could be read before keeps its pose; the surface does without it.
    frame.reason = error;
    if (error.empty())
      volume.integrate(rgbd, camera, frame.world_from_depth, corrections[index]);
    return !progress || progress({"surface", ++done, fused.size()});
  };
  const auto correct = [&](std::size_t index, const RGBDFrame& rgbd) {
    return frameToFuse(dataset, result, moving, index, rgbd);
  };
  if (!readInOrder(dataset, fused, options.num_threads, fuse, correct))
    return false;
  if (options.max_memory > 0 && volume.memoryBytes() > options.max_memory)
    result.findings.push_back(memoryFinding(volume.memoryBytes(), options.max_memory));
  result.mesh = toPolygonMesh(extractSurface(std::move(volume), options.mesh, &result.mesh_report));
  return true;
}

} // namespace bundle_icp
