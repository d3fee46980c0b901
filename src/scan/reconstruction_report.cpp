// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/reconstruction_report.h"

#include <bundle_icp/common/printable_text.h>
#include <bundle_icp/version.h>

#include <boost/filesystem.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <map>

namespace bundle_icp {
namespace {

using Json = nlohmann::ordered_json;

Json
toJson(const Pose& pose)
{
  const Eigen::Vector3d t = pose.translation();
  const Eigen::Quaterniond q(pose.linear());
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

Json
toJson(const FrameReport& frame)
{
  Json json{{"id", frame.id},
            {"timestamp", frame.timestamp},
            {"name", frame.name},
            {"registered", frame.registered}};
  if (frame.registered) {
    json["component"] = frame.component;
    json["world_from_camera"] = toJson(frame.world_from_camera);
  }
  if (!frame.reason.empty())
    json["reason"] = frame.reason;
  json["verdict"] = toString(frame.verdict);
  if (!frame.doubt.empty())
    json["doubt"] = frame.doubt;
  if (frame.depth_agreement)
    json["depth_agreement"] = *frame.depth_agreement;
  if (frame.moving_share > 0)
    json["moving_share"] = frame.moving_share;
  json["features"] = frame.features;
  json["matches"] = frame.matches;
  json["inliers"] = frame.inliers;
  json["icp_rmse"] = frame.icp_rmse;
  json["position_deviation"] = frame.position_deviation;
  json["rotation_deviation"] = frame.rotation_deviation;
  if (frame.by_geometry)
    json["by_geometry"] = true;
  if (!frame.depth_error.isZero(0))
    json["depth_error"] = {frame.depth_error[0], frame.depth_error[1], frame.depth_error[2]};
  return json;
}

Json
toJson(const Finding& finding)
{
  Json json{{"severity", toString(finding.severity)},
            {"kind", finding.kind},
            {"what", finding.what},
            {"evidence", Json::object()}};
  for (const auto& [name, value] : finding.evidence)
    json["evidence"][name] = value;
  if (!finding.remedy.empty())
    json["remedy"] = finding.remedy;
  return json;
}

Json
toJson(const NextView& view, const ReconstructionResult& result)
{
  Json json{{"purpose", toString(view.purpose)},
            {"what", toString(view, result)},
            {"world_from_camera", toJson(view.world_from_camera)},
            {"nearest_frame", result.frames[view.nearest_frame].id},
            {"distance", view.distance},
            {"angle", view.angle}};
  if (view.purpose == NextViewPurpose::CONNECT_COMPONENT) {
    json["component"] = view.component;
    json["other_frame"] = result.frames[view.other_frame].id;
  }
  else {
    json["center"] = {view.center.x(), view.center.y(), view.center.z()};
    json["area"] = view.area;
    json["shared"] = view.shared;
  }
  return json;
}

Json
toJson(const ComponentJoint& joint)
{
  return {{"first_frames", joint.first_frames}, {"second_frames", joint.second_frames},
          {"held_frames", joint.held_frames},   {"overlap", joint.overlap},
          {"agreement", joint.agreement},       {"matches", joint.matches},
          {"support", joint.support},           {"runner_up_support", joint.runner_up_support}};
}

Json
toJson(const CameraIntrinsics& camera)
{
  return {{"width", camera.width}, {"height", camera.height}, {"fx", camera.fx},
          {"fy", camera.fy},       {"cx", camera.cx},         {"cy", camera.cy}};
}

/** As --roi takes it: two corners, or, when it is turned, centre, edges and orientation. */
Json
toJson(const OrientedBox& box)
{
  const Eigen::Vector3d center = box.world_from_box.translation(), half = 0.5 * box.size;
  if (box.isAligned()) {
    const Eigen::Vector3d low = center - half, high = center + half;
    return {low.x(), low.y(), low.z(), high.x(), high.y(), high.z()};
  }
  const Eigen::Quaterniond q(box.world_from_box.linear());
  return {center.x(),   center.y(), center.z(), box.size.x(), box.size.y(),
          box.size.z(), q.x(),      q.y(),      q.z(),        q.w()};
}

/** As --sensor takes it. */
Json
toJson(const DepthNoise& noise)
{
  return {{"name", sensorName(noise)},
          {"constant", noise.constant},
          {"quadratic", noise.quadratic},
          {"offset", noise.offset}};
}

Json
toJson(const ReconstructionOptions& options, const DepthNoise& noise)
{
  Json json{{"method", options.poses ? "given_poses" : toString(options.method)},
            {"moving", options.moving == MovingPart::OBJECT ? "object" : "camera"},
            {"sensor", toJson(noise)},
            {"features", options.find_features ? "own" : "sift"},
            {"max_features", options.features.max_features},
            {"matching", toString(options.graph.matching.backend)},
            {"min_matches", options.graph.matching.min_matches},
            {"exhaustive_limit", options.graph.exhaustive_limit},
            {"depth_reduction", options.depth_reduction},
            {"threads", options.num_threads},
            {"max_memory", options.max_memory},
            {"mesh", options.make_mesh},
            {"voxel_size", options.volume.voxel_size},
            {"truncation", options.volume.truncation},
            {"smooth", options.mesh.smoothing.iterations},
            {"min_component", options.mesh.cleaning.min_component_area},
            {"fill_holes", options.mesh.cleaning.max_hole_perimeter},
            {"decimate", options.mesh.decimation.max_triangles},
            {"decimate_error", options.mesh.decimation.max_error},
            {"min_depth", options.volume.min_depth},
            {"max_depth", options.volume.max_depth}};
  if (options.poses)
    json["poses"] = options.poses->source;
  if (options.volume.region)
    json["roi"] = toJson(*options.volume.region);
  if (options.object)
    json["roi"] = "object";
  return json;
}

Json
meshReport(const ReconstructionResult& result)
{
  const MeshCleaningResult& cleaning = result.mesh_report.cleaning;
  const MeshDecimationResult& decimation = result.mesh_report.decimation;
  Json json{{"vertices", std::size_t(result.mesh.cloud.width) * result.mesh.cloud.height},
            {"triangles", result.mesh.polygons.size()},
            {"small_components_removed", cleaning.small_components},
            {"holes_filled", cleaning.holes_filled},
            {"filled_area", cleaning.filled_area}};
  if (decimation.triangles_after < decimation.triangles_before)
    json["decimation"] = {{"triangles_before", decimation.triangles_before},
                          {"error", decimation.statedError()},
                          {"max_error", decimation.max_error},
                          {"rms_error", decimation.rms_error},
                          {"max_reverse_error", decimation.max_reverse_error}};
  return json;
}

Json
toJson(const ObjectRegion& object)
{
  if (!object.is_found)
    return {{"found", false}, {"reason", object.reason}};
  return {{"found", true},
          {"roi", toJson(object.box)},
          {"plane", {object.plane[0], object.plane[1], object.plane[2], object.plane[3]}},
          {"looking_frames", object.looking_frames},
          {"frames", object.num_frames}};
}

bool
isEstimated(const ReconstructionResult& result, CalibrationParameter parameter)
{
  const auto& estimated = result.self_calibration.calibrated;
  return std::find(estimated.begin(), estimated.end(), parameter) != estimated.end();
}

Json
toJson(const CalibrationTest& test)
{
  Json json{{"name", test.name}, {"parameters", Json::array()}};
  for (const CalibrationParameter parameter : test.parameters)
    json["parameters"].push_back(calibrationName(parameter));
  json["applied"] = test.applied;
  if (!test.implausible.empty())
    json["implausible"] = test.implausible;
  json["gain"] = test.gain;
  json["significance"] = test.significance;
  return json;
}

Json
depthScaleReport(const Calibration& calibration)
{
  static const std::map<DepthScaleOrigin, std::string> origins{
      {DepthScaleOrigin::NOMINAL, "nominal: depth is taken as the recording gives it"},
      {DepthScaleOrigin::CALIBRATION_FILE, "from a calibration file"},
      {DepthScaleOrigin::KNOWN_DISTANCE, "from a known distance"}};
  return {{"value", calibration.depth_scale},
          {"remark",
           "A scale of all depth cannot be observed in a scan and is not estimated; this one is " +
               origins.at(calibration.depth_scale_origin) + "."}};
}

/** What the poses were computed with, and which corrections were tested. */
Json
calibrationReport(const RGBDDataset& dataset, const ReconstructionResult& result)
{
  const Calibration& calibration = result.model.calibration();
  Json json{{"nominal_camera", toJson(dataset.camera())},
            {"corrected_camera", toJson(calibration.corrected(dataset.camera()))}};
  for (int i = 0; i < NUM_CALIBRATION_PARAMETERS; ++i) {
    const auto parameter = CalibrationParameter(i);
    const bool is_estimated = isEstimated(result, parameter);
    json["parameters"][calibrationName(parameter)] = {
        {"value", calibration.values[i]},
        {"deviation", calibration.deviations[i]},
        {"unit", calibrationUnit(parameter)},
        {"applied", is_estimated || calibration.values[i] != 0},
        {"estimated", is_estimated}};
  }
  json["depth_error_of_each_image"] = result.self_calibration.depth_errors;
  json["depth_scale"] = depthScaleReport(calibration);
  json["tests"] = Json::array();
  for (const CalibrationTest& test : result.self_calibration.tests)
    json["tests"].push_back(toJson(test));
  return json;
}

/** JSON holds UTF-8 alone, names of files any bytes. */
void
makePrintable(Json& json)
{
  if (json.is_string())
    json = printable(json.get<std::string>());
  else if (json.is_structured())
    for (Json& part : json)
      makePrintable(part);
}

/** The recording of a frame, from wherever one looks. */
std::string
placeOf(const RGBDDataset& dataset, std::size_t frame)
{
  const std::string recording = dataset.recording(frame);
  return recording.empty() ? recording
                           : boost::filesystem::absolute(recording).lexically_normal().string();
}

/** The recordings that the frames belong to, each once. */
Json
recordingsOf(const RGBDDataset& dataset)
{
  Json recordings = Json::array();
  for (std::size_t i = 0; i < dataset.size(); ++i)
    if (const std::string recording = placeOf(dataset, i);
        std::find(recordings.begin(), recordings.end(), recording) == recordings.end())
      recordings.push_back(recording);
  return recordings;
}

} // namespace

nlohmann::ordered_json
makeReport(const RGBDDataset& dataset, const ReconstructionOptions& options,
           const ReconstructionResult& result)
{
  Json report{{"version", BUNDLE_ICP_VERSION},
              {"dataset",
               {{"format", dataset.format()},
                {"frames", dataset.size()},
                {"recordings", recordingsOf(dataset)}}},
              {"status", toString(result.status)},
              {"verdict", toString(result.verdict())},
              {"findings", Json::array()}};
  for (const Finding& finding : result.findings)
    report["findings"].push_back(toJson(finding));
  report["frames"] = Json::array();
  for (std::size_t i = 0; i < result.frames.size(); ++i) {
    Json frame = toJson(result.frames[i]);
    frame["recording"] = placeOf(dataset, i);
    report["frames"].push_back(frame);
  }
  report["skipped_files"] = Json::array();
  for (const SkippedFile& skipped : dataset.skipped())
    report["skipped_files"].push_back({{"file", skipped.file}, {"reason", skipped.reason}});
  report["components"] = Json::array();
  for (std::size_t c = 0; c < result.component_sizes.size(); ++c)
    report["components"].push_back({{"component", c}, {"frames", result.component_sizes[c]}});
  report["joints"] = Json::array();
  for (const ComponentJoint& joint : result.joints)
    report["joints"].push_back(toJson(joint));
  if (result.object)
    report["object"] = toJson(*result.object);
  for (const auto& [stage, seconds] : result.timing_s)
    report["timing_s"][stage] = seconds;
  report["peak_memory_bytes"] = result.peak_memory_bytes;
  if (!result.mesh.polygons.empty())
    report["mesh"] = meshReport(result);
  if (options.next_views) {
    report["next_views"] = Json::array();
    for (const NextView& view : result.next_views)
      report["next_views"].push_back(toJson(view, result));
  }
  report["calibration"] = calibrationReport(dataset, result);
  report["options"] = toJson(options, dataset.camera().depth_noise);
  makePrintable(report);
  return report;
}

} // namespace bundle_icp
