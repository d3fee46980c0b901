// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// What bundle_icp_reconstruct prints of a result.
#pragma once

#include <bundle_icp/common/printable_text.h>
#include <bundle_icp/reconstruction.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace bundle_icp {

/** The reasons of frames without a pose, or without a part in the surface; frames with the same
 *  reason share a line, which names the first `max_names` of them. */
inline void
printReasons(const ReconstructionResult& result, std::size_t max_names)
{
  std::map<std::string, std::vector<std::string>> frames_of;
  for (const FrameReport& frame : result.frames)
    if (!frame.registered || !frame.reason.empty())
      frames_of[frame.reason].push_back(frame.name);
  for (const auto& [reason, frames] : frames_of) {
    std::string names;
    for (std::size_t i = 0; i < frames.size() && i < max_names; ++i)
      names += (i ? ", " : "") + frames[i];
    if (frames.size() > max_names)
      names += " and " + std::to_string(frames.size() - max_names) + " more";
    std::cerr << printable(names + ": " + reason) << "\n";
  }
}

/** Each correction that was applied: "readout 0.0233 +- 0.0002 s". */
inline void
printCorrections(const ReconstructionResult& result)
{
  const Calibration& calibration = result.model.calibration();
  for (int i = 0; i < NUM_CALIBRATION_PARAMETERS; ++i) {
    const double value = calibration.values[i], deviation = calibration.deviations[i];
    if (value == 0)
      continue;
    std::ostringstream text;
    text << calibrationName(CalibrationParameter(i)) << " ";
    if (deviation > 0)
      text << std::fixed << std::setprecision(std::max(0, int(-std::floor(std::log10(deviation)))))
           << value << " +- " << deviation;
    else
      text << value;
    const std::string unit = calibrationUnit(CalibrationParameter(i));
    std::cerr << "calibration: " << text.str() << (unit == "1" ? "" : " " + unit) << "\n";
  }
  if (calibration.depth_scale != 1)
    std::cerr << "calibration: depth_scale " << calibration.depth_scale << "\n";
  if (result.self_calibration.depth_errors)
    std::cerr << "calibration: depth error of each image\n";
}

/** Prints how cleaning and decimation changed the mesh. */
inline void
printMeshReport(const ReconstructionResult& result)
{
  const MeshReport& report = result.mesh_report;
  if (report.cleaning.holes_filled > 0)
    std::cerr << "mesh: " << report.cleaning.holes_filled << " holes filled, "
              << 1e4 * report.cleaning.filled_area << " cm^2 that were not measured\n";
  const MeshDecimationResult& decimation = report.decimation;
  if (decimation.triangles_after < decimation.triangles_before)
    std::cerr << "mesh: " << decimation.triangles_before << " triangles became "
              << decimation.triangles_after << "; largest deviation "
              << 1e3 * decimation.statedError() << " mm, RMS " << 1e3 * decimation.rms_error
              << " mm\n";
}

/** Prints the box of the object in the form of --roi. */
inline void
printObject(const ReconstructionResult& result)
{
  if (!result.object)
    return;
  const OrientedBox& box = result.object->box;
  const Eigen::Vector3d center = box.world_from_box.translation();
  const Eigen::Quaterniond turn(box.world_from_box.linear());
  const Eigen::IOFormat commas(4, Eigen::DontAlignCols, ",", ",");
  std::cerr << "object: " << result.object->looking_frames << " of " << result.object->num_frames
            << " frames look at it; --roi " << center.transpose().format(commas) << ","
            << box.size.transpose().format(commas) << ","
            << turn.coeffs().transpose().format(commas) << "\n";
}

/** What a user should know, the gravest first; what is merely worth knowing is in the report. */
inline std::vector<Finding>
findingsAboveNote(const ReconstructionResult& result)
{
  std::vector<Finding> findings = result.findings;
  findings.erase(
      std::remove_if(findings.begin(), findings.end(),
                     [](const Finding& finding) { return finding.severity == Severity::NOTE; }),
      findings.end());
  std::stable_sort(findings.begin(), findings.end(),
                   [](const Finding& a, const Finding& b) { return a.severity > b.severity; });
  return findings;
}

/** The verdict with its three most important reasons and what to do. */
inline void
printVerdict(const ReconstructionResult& result)
{
  constexpr std::size_t num_reasons = 3;
  const std::vector<Finding> findings = findingsAboveNote(result);
  for (std::size_t i = num_reasons; i < findings.size(); ++i)
    std::cerr << toString(findings[i]) << "\n";
  std::cout << "verdict: " << toString(result.verdict()) << "\n";
  for (std::size_t i = 0; i < std::min(num_reasons, findings.size()); ++i)
    std::cout << "  " << toString(findings[i]) << "\n";
}

/** Frames whose poses other frames contradict. */
inline void
printDoubts(const ReconstructionResult& result)
{
  constexpr std::size_t max_names = 3;
  std::size_t count = 0;
  for (const FrameReport& frame : result.frames)
    if (frame.verdict == FrameVerdict::DOUBTFUL && ++count <= max_names)
      std::cerr << printable(frame.name) << ": doubtful pose: " << frame.doubt << "\n";
  if (count > max_names)
    std::cerr << "and " << count - max_names << " more frames with a doubtful pose\n";
}

/** How large the scene is, where a wrong unit shows; which masks and which estimated camera it is
 *  made with. */
inline void
printScene(const ReconstructionResult& result)
{
  for (const Finding& finding : result.findings)
    if (finding.kind == "scene" || finding.kind == "masks" ||
        finding.kind == "estimated_intrinsics")
      std::cout << printable(finding.what) << "\n";
}

/** A line for each view that was asked for. */
inline void
printNextViews(const ReconstructionOptions& options, const ReconstructionResult& result)
{
  for (std::size_t i = 0; i < result.next_views.size(); ++i)
    std::cout << "next view " << i + 1 << ": " << printable(toString(result.next_views[i], result))
              << "\n";
  if (options.next_views && result.next_views.empty())
    std::cout << "next view: none, no hole was found that a view would close\n";
}

} // namespace bundle_icp
