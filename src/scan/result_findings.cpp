// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/result_findings.h"

#include "refinement/format_text.h"
#include "refinement/still_camera.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bundle_icp {
namespace {

double
quantile(std::vector<double>& values, double share)
{
  const auto place = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/** What moves in more of the frames does not pass by chance. */
constexpr double MOST_FRAMES = 0.5;

/** Of the features of frames with a pose [m]. */
std::vector<double>
featureDepths(const ReconstructionResult& result)
{
  std::vector<double> depths;
  for (std::size_t node = 0; result.graph && node < result.graph->size(); ++node)
    if (result.model.isRegistered(node))
      for (const float depth : result.graph->features(node).depths)
        if (depth > 0)
          depths.push_back(depth);
  return depths;
}

Finding
cameraFixedFinding(const cv::Mat& mask)
{
  const double share = double(cv::countNonZero(mask)) / double(mask.total());
  return {Severity::WARNING,
          "moves_with_camera",
          formatText("%.0f %% of the image moves with the camera (a gripper, a hand, a part of the "
                     "mount): its depth is left out of poses and surface",
                     100 * share),
          {{"share_of_image", share}},
          ""};
}

Finding
markFinding(const cv::Mat& mask)
{
  const double share = double(cv::countNonZero(mask)) / double(mask.total());
  return {
      Severity::NOTE,
      "mark_in_image",
      formatText("a mark stays in the image (text, a logo, a scratch of the lens): %.0f %% of the "
                 "image is left out of poses and surface",
                 100 * share),
      {{"share_of_image", share}},
      ""};
}

} // namespace

std::vector<Finding>
stayingFindings(const StayingPixels& staying, MovingPart moving)
{
  std::vector<Finding> findings;
  const std::vector<std::pair<std::string, double>> evidence{
      {"share_that_stays", staying.share_of_surroundings},
      {"share_of_image_that_moves", staying.moving_share},
      {"share_of_frames", staying.moving_frames}};
  const bool is_wanted = moving == MovingPart::OBJECT;
  if (!staying.camera_fixed.empty())
    findings.push_back(cameraFixedFinding(staying.camera_fixed));
  if (!staying.mark.empty())
    findings.push_back(markFinding(staying.mark));
  if (is_wanted && !staying.cameraStandsStill())
    findings.push_back(
        {Severity::FAULT, "moving_object",
         (staying.share_of_surroundings > 0
              ? formatText("the camera does not stand still: only %.0f %% of the image stays as it "
                           "is",
                           100 * staying.share_of_surroundings)
              : "nothing shows that the camera stands still: too few frames, or surroundings too "
                "plain") +
             std::string("; poses and surface are those of the surroundings"),
         evidence, "without --moving object"});
  else if (is_wanted && staying.moving_frames == 0)
    findings.push_back({Severity::FAULT, "moving_object",
                        "nothing moves before the camera, which stands still", evidence,
                        "without --moving object"});
  else if (is_wanted)
    findings.push_back(
        {Severity::NOTE, "moving_object",
         formatText("poses and surface are those of the thing that moves before the camera, in "
                    "%.0f %% of the image; the surroundings are left out",
                    100 * staying.moving_share),
         evidence, ""});
  else if (staying.cameraStandsStill() && staying.moving_frames > 0)
    findings.push_back(
        {staying.moving_frames > MOST_FRAMES ? Severity::WARNING : Severity::NOTE, "moving_object",
         formatText("the camera stands still, and something else moves in %.0f %% of the frames, "
                    "in %.0f %% of the image: it is left out of poses and surface",
                    100 * staying.moving_frames, 100 * staying.moving_share),
         evidence,
         "if it is the thing that is wanted, on a turntable or in hands: --moving object"});
  return findings;
}

std::vector<Finding>
movingFindings(const std::vector<FrameReport>& frames)
{
  double moving = 0, registered = 0, most = 0;
  for (const FrameReport& frame : frames) {
    registered += frame.registered;
    moving += frame.moving_share > 0;
    most = std::max(most, frame.moving_share);
  }
  if (moving == 0)
    return {};
  return {
      {Severity::NOTE,
       "moving_things",
       formatText("in %.0f of %.0f frames, up to %.0f %% of the depth lies where other frames saw "
                  "free space: something moves there, and the surface leaves it out",
                  moving, registered, 100 * most),
       {{"frames", moving}, {"largest_share", most}},
       ""}};
}

std::vector<Finding>
twoMotionsFindings(const ImageGraph& graph)
{
  constexpr double large_share = 0.2; // from here on the other motion may be that of the scene
  double two = 0;
  for (std::size_t node = 0; node < graph.size(); ++node)
    for (const ImageEdge& edge : graph.edges(node))
      two += edge.neighbour > node && !edge.pair->matches_of_other_motion.empty();
  const auto pairs = double(graph.numEdges());
  if (two == 0)
    return {};
  return {{two > large_share * pairs ? Severity::WARNING : Severity::NOTE,
           "two_motions",
           formatText("in %.0f of %.0f pairs of images something moves there on its own: poses are "
                      "those of what fills more of the images",
                      two, pairs),
           {{"pairs", two}, {"share", two / pairs}},
           "leave it out by images in a folder mask/, or record without it"}};
}

std::vector<Finding>
jointFindings(const std::vector<ComponentJoint>& joints)
{
  if (joints.empty())
    return {};
  std::size_t frames = 0;
  double least_overlap = 1, least_agreement = 1;
  std::string each;
  for (const ComponentJoint& joint : joints) {
    frames += joint.second_frames;
    least_overlap = std::min(least_overlap, joint.overlap);
    least_agreement = std::min(least_agreement, joint.agreement);
    each += formatText("%s%zu to %zu (overlap %.0f %%, %.1f %% of it agrees, %zu matches)",
                       each.empty() ? "" : ", ", joint.second_frames, joint.first_frames,
                       100 * joint.overlap, 100 * joint.agreement, joint.matches);
  }
  return {{Severity::WARNING,
           "joined_by_geometry",
           formatText("%zu frames were joined by geometry alone: ", frames) + each,
           {{"frames", double(frames)},
            {"joints", double(joints.size())},
            {"least_overlap", least_overlap},
            {"least_agreement", least_agreement}},
           "look whether walls are double; record again with more overlap where they are joined"}};
}

std::vector<Finding>
timeOffsetFindings(const ReconstructionResult& result, bool has_times)
{
  // Cameras that run free at 30 Hz are paired within 17 ms; exposure and transport add less.
  constexpr double longest_time = 0.04, most_frames = 0.75;
  const auto& estimated = result.self_calibration.calibrated;
  if (std::find(estimated.begin(), estimated.end(), CalibrationParameter::TIME_OFFSET) ==
      estimated.end())
    return {};
  const double offset = result.model.calibration()[CalibrationParameter::TIME_OFFSET];
  const Trajectory trajectory = result.trajectory(0);
  std::vector<double> steps;
  for (std::size_t i = 1; i < trajectory.size(); ++i)
    steps.push_back(trajectory[i].timestamp - trajectory[i - 1].timestamp);
  const double step = steps.empty() ? 0 : quantile(steps, 0.5);
  const double frames = step > 0 ? offset / step : 0;
  if (has_times ? std::abs(offset) <= longest_time : std::abs(frames) <= most_frames)
    return {};
  return {{Severity::FAULT,
           "color_and_depth",
           "colour and depth are of other moments: by the poses depth was taken " +
               (has_times ? formatText("%.3f s", std::abs(offset))
                          : formatText("%.1f frames", std::abs(frames))) +
               (offset > 0 ? " after" : " before") + " its colour image",
           {{"time_offset_s", offset}, {"time_offset_frames", frames}},
           "pair the images by time; check the clocks of the two streams"}};
}

std::vector<Finding>
stillCameraFindings(const ReconstructionResult& result)
{
  const auto still = findStillCamera(*result.graph, result.model, 0);
  if (!still)
    return {};
  const double millimetres = 1000 * still->distance, degrees = still->angle * 180 / M_PI;
  return {
      {Severity::NOTE,
       "still_camera",
       formatText("the camera hardly moves: %zu frames lie within %.1f mm and %.2f degrees; the "
                  "surface shows one side only, and the calibration is not tested",
                  still->frames, millimetres, degrees),
       {{"frames", double(still->frames)},
        {"distance_m", still->distance},
        {"angle_degrees", degrees}},
       ""}};
}

std::vector<Finding>
sceneFindings(const ReconstructionResult& result)
{
  std::vector<double> depths = featureDepths(result), along[3];
  for (const ScenePoint& point : result.model.points())
    if (!point.track.empty() && result.model.component(point.track.front().frame) == 0)
      for (int axis = 0; axis < 3; ++axis)
        along[axis].push_back(point.position[axis]);
  if (depths.empty() || along[0].empty())
    return {};
  constexpr double few = 0.02; // points that lie far outside do not make the scene larger
  double extent[3];
  for (int axis = 0; axis < 3; ++axis)
    extent[axis] = quantile(along[axis], 1 - few) - quantile(along[axis], few);
  const double median = quantile(depths, 0.5);
  return {{Severity::NOTE,
           "scene",
           formatText("median depth %.2f m, the scene is %.2f x %.2f x %.2f m large", median,
                      extent[0], extent[1], extent[2]),
           {{"median_depth_m", median},
            {"extent_x_m", extent[0]},
            {"extent_y_m", extent[1]},
            {"extent_z_m", extent[2]}},
           ""}};
}

std::vector<Finding>
placementFindings(const ReconstructionResult& result)
{
  constexpr double most = 0.8, half = 0.5;
  if (result.component_sizes.empty())
    return {}; // nothing was registered: that is the status
  const std::size_t all = result.frames.size(), placed = result.component_sizes.front();
  const double share = double(placed) / double(all);
  if (share >= most)
    return {};
  const std::size_t elsewhere = std::accumulate(result.component_sizes.begin() + 1,
                                                result.component_sizes.end(), std::size_t(0));
  return {{share < half ? Severity::FAULT : Severity::WARNING,
           "frames_without_pose",
           formatText("%zu of %zu frames have no pose in the largest world", all - placed, all) +
               (elsewhere > 0 ? formatText(", %zu of them have one in another", elsewhere) : ""),
           {{"frames_without_pose", double(all - placed)}, {"share", 1 - share}},
           "report.json has the reason of each; record again what is missing, slower and with more "
           "overlap"}};
}

Finding
trackedFinding(ReconstructionMethod method)
{
  return {Severity::WARNING,
          "not_verified",
          "the method " + toString(method) + " tracks frame by frame: nothing verifies its poses",
          {},
          "--method bundle_icp verifies them"};
}

Finding
stoppedFinding()
{
  return {Severity::FAULT,
          "stopped",
          "the run was stopped: the result is what there was by then",
          {},
          "run it to its end"};
}

std::vector<Finding>
unreadableFindings(const ReconstructionResult& result)
{
  constexpr double half = 0.5;
  double registered = 0, lost = 0;
  for (const FrameReport& frame : result.frames) {
    registered += frame.registered;
    lost += frame.registered && !frame.reason.empty();
  }
  if (lost == 0)
    return {};
  return {{lost < half * registered ? Severity::WARNING : Severity::FAULT,
           "unreadable_frames",
           formatText("%.0f of %.0f frames with a pose could not be read for the surface, which is "
                      "made without them",
                      lost, registered),
           {{"frames", lost}},
           "report.json has the reason of each"}};
}

Finding
memoryFinding(std::size_t voxel_bytes, std::size_t max_memory)
{
  constexpr double mebibyte = 1 << 20;
  return {Severity::NOTE,
          "memory",
          formatText("the voxels of the surface take %.0f MiB, more than the %.0f MiB of --memory, "
                     "to which only poses and matching keep",
                     double(voxel_bytes) / mebibyte, double(max_memory) / mebibyte),
          {{"voxel_bytes", double(voxel_bytes)}, {"max_memory_bytes", double(max_memory)}},
          "--voxel-size with larger voxels, a smaller --roi or --no-mesh need less"};
}

Finding
emptySurface(const ReconstructionOptions& options, const ReconstructionResult& result)
{
  Finding finding{Severity::FAULT, "empty_surface", "the surface is empty", {}, ""};
  if (std::all_of(result.frames.begin(), result.frames.end(), [](const FrameReport& frame) {
        return !frame.registered || !frame.reason.empty();
      })) {
    finding.what += ": no frame with a pose could be read";
    finding.remedy = "report.json has the reason of each";
    return finding;
  }
  std::vector<double> depths = featureDepths(result);
  const TSDFOptions& volume = options.volume;
  const auto inside = std::count_if(depths.begin(), depths.end(), [&volume](double depth) {
    return depth >= volume.min_depth && depth <= volume.max_depth;
  });
  if (!depths.empty()) {
    const double median = quantile(depths, 0.5), share = double(inside) / double(depths.size());
    finding.evidence = {{"median_depth_m", median}, {"share_within_depth_limits", share}};
    if (share < 0.05) {
      finding.what += formatText(": hardly any depth lies between %.3g and %.3g m, its median is "
                                 "%.3g m",
                                 volume.min_depth, volume.max_depth, median);
      finding.remedy = "if the scene is not that far away, the unit of depth is wrong: "
                       "--depth-scale; else --min-depth and --max-depth";
      return finding;
    }
  }
  if (result.mesh_report.cleaning.small_components > 0) {
    finding.what += formatText(": its %zu pieces are smaller than --min-component",
                               std::size_t(result.mesh_report.cleaning.small_components));
    finding.remedy = "a smaller --min-component";
  }
  else if (volume.region || result.object) {
    finding.what += ": no depth lies in the region of interest";
    finding.remedy = "another --roi";
  }
  else
    finding.remedy = "check the unit of depth (--depth-scale), --voxel-size and --truncation";
  return finding;
}

} // namespace bundle_icp
