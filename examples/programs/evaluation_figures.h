// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/printable_text.h>
#include <bundle_icp/evaluation/surface_error.h>
#include <bundle_icp/evaluation/trajectory_error.h>

#include <nlohmann/json.hpp>

#include <cstdio>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** Figures of bundle_icp_evaluate. */
struct Evaluation {
  std::size_t num_poses = 0, num_frames = 0, num_frames_with_pose = 0;
  AbsoluteTrajectoryError absolute;
  std::optional<RelativePoseError> frame, second, all_pairs;
  std::optional<SurfaceError> surface;
  std::vector<std::string> warnings; ///< why figures say little, or compare with no truth
  bool say_little = false;
};

inline nlohmann::ordered_json
toJson(const ErrorStatistics& s)
{
  return {
      {"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"max", s.max}, {"count", s.count}};
}

inline nlohmann::ordered_json
toJson(const std::optional<RelativePoseError>& error)
{
  if (!error)
    return nullptr;
  return {{"translation_m", toJson(error->translation)}, {"rotation_rad", toJson(error->rotation)}};
}

/** \param complete_within distance that Evaluation::surface counts as reconstructed [m] */
inline void
printJson(const Evaluation& e, double complete_within)
{
  nlohmann::ordered_json json;
  json["poses"] = e.num_poses;
  json["frames"] = nullptr;
  json["frames_with_pose"] = nullptr;
  json["fraction_with_pose"] = nullptr;
  if (e.num_frames > 0) {
    json["frames"] = e.num_frames;
    json["frames_with_pose"] = e.num_frames_with_pose;
    json["fraction_with_pose"] = double(e.num_frames_with_pose) / double(e.num_frames);
  }
  json["ate_m"] = toJson(e.absolute.translation);
  json["rpe_frame"] = toJson(e.frame);
  json["rpe_second"] = toJson(e.second);
  json["rpe_all_pairs"] = toJson(e.all_pairs);
  if (e.surface) {
    json["mesh_m"] = toJson(e.surface->accuracy);
    json["mesh_completeness"] = e.surface->completeness;
    json["mesh_complete_within_m"] = complete_within;
  }
  json["warnings"] = nlohmann::ordered_json::array();
  for (const std::string& warning : e.warnings)
    json["warnings"].push_back(printable(warning));
  std::cout << json.dump(2) << "\n";
}

inline void
printRelative(const char* name, const std::optional<RelativePoseError>& error)
{
  if (error)
    std::printf("RPE %-15s translation rmse %.6f m  rotation rmse %.6f rad  mean %.6f rad"
                "  (%zu pairs)\n",
                name, error->translation.rmse, error->rotation.rmse, error->rotation.mean,
                error->rotation.count);
  else
    std::printf("RPE %-15s not known: fewer than 2 pairs\n", name);
}

inline void
printTable(const Evaluation& e, double complete_within)
{
  if (e.num_frames > 0)
    std::printf("frames with a pose  %zu of %zu (%.1f %%)\n", e.num_frames_with_pose, e.num_frames,
                100.0 * e.num_frames_with_pose / e.num_frames);
  else
    std::printf("frames with a pose  not known (%zu poses; give --frames or a folder)\n",
                e.num_poses);
  const ErrorStatistics& ate = e.absolute.translation;
  std::printf("ATE                 rmse %.6f m  mean %.6f m  median %.6f m  max %.6f m"
              "  (%zu pairs)\n",
              ate.rmse, ate.mean, ate.median, ate.max, ate.count);
  printRelative("per frame", e.frame);
  printRelative("per second", e.second);
  printRelative("all pairs", e.all_pairs);
  if (!e.surface)
    return;
  const ErrorStatistics& mesh = e.surface->accuracy;
  std::printf("mesh                mean %.6f m  rmse %.6f m  median %.6f m  max %.6f m"
              "  (%zu samples)\n",
              mesh.mean, mesh.rmse, mesh.median, mesh.max, mesh.count);
  std::printf("mesh completeness   %.1f %% of the surface within %g m\n",
              100 * e.surface->completeness, complete_within);
}

} // namespace bundle_icp
