// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "tables.h"

#include <bundle_icp/common/printable_text.h>
#include <bundle_icp/version.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace bundle_icp {
namespace {

using Json = nlohmann::ordered_json;

template <typename... Values>
std::string
format(const char* pattern, Values... values)
{
  char text[128];
  std::snprintf(text, sizeof(text), pattern, values...);
  return text;
}

/** As in the paper: RMSE of the translation, mean of the rotation. */
std::string
cells(const std::optional<RelativePoseError>& error)
{
  return error ? format(" %.5f | %.5f |", error->translation.rmse, error->rotation.mean)
               : " - | - |";
}

std::string
curveTable(const std::vector<ConditionResult>& conditions, Axis axis)
{
  std::string head = "| " + title(axis) + " |", rule = "| --- |", rows;
  for (const Measurement& m : conditions.front().measurements) {
    head += " " + m.variant + " |";
    rule += " --- |";
  }
  for (const ConditionResult& result : conditions) {
    rows += "| " + label(result.condition, axis) + " |";
    for (const Measurement& m : result.measurements)
      rows += (m.absolute ? format(" %.2f cm", 100 * m.absolute->translation.rmse) : " -") +
              format(", %.0f %% |", 100 * m.share());
    rows += "\n";
  }
  return head + "\n" + rule + "\n" + rows;
}

Json
toJson(const ErrorStatistics& s)
{
  return {
      {"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"max", s.max}, {"count", s.count}};
}

Json
toJson(const std::optional<RelativePoseError>& error)
{
  if (!error)
    return nullptr;
  return {{"translation_m", toJson(error->translation)}, {"rotation_rad", toJson(error->rotation)}};
}

Json
toJson(const Measurement& m)
{
  Json json{{"method", m.variant},
            {"frames", m.frames},
            {"frames_with_pose", m.registered},
            {"fraction_with_pose", m.share()},
            {"time_s", m.seconds}};
  json["ate_m"] = m.absolute ? toJson(m.absolute->translation) : Json(nullptr);
  json["rpe_frame"] = toJson(m.frame);
  json["rpe_second"] = toJson(m.second);
  json["rpe_all_pairs"] = toJson(m.all_pairs);
  return json;
}

} // namespace

std::vector<ConditionResult>
curve(const ScanResult& scan, Axis axis)
{
  std::vector<ConditionResult> chosen;
  for (const ConditionResult& result : scan.conditions)
    if (axis == Axis::KEEP ? result.condition.blur == 0 : result.condition.keep == 1)
      chosen.push_back(result);
  std::stable_sort(chosen.begin(), chosen.end(),
                   [](const ConditionResult& a, const ConditionResult& b) {
                     return std::make_pair(a.condition.keep, a.condition.blur) <
                            std::make_pair(b.condition.keep, b.condition.blur);
                   });
  if (chosen.size() < 2)
    chosen.clear();
  return chosen;
}

std::string
title(Axis axis)
{
  return axis == Axis::KEEP ? "every n-th frame" : "blurred images [%]";
}

std::string
label(const Condition& condition, Axis axis)
{
  return std::to_string(axis == Axis::KEEP ? long(condition.keep)
                                           : std::lround(100 * condition.blur));
}

std::string
toMarkdown(const ConditionResult& result)
{
  std::string text = "| method | frames with a pose | ATE [m] | RPE per frame [m] | "
                     "[rad] | per second [m] "
                     "| [rad] | all pairs [m] | [rad] | time [s] |\n"
                     "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (const Measurement& m : result.measurements)
    text += "| " + m.variant +
            format(" | %zu of %zu (%.0f %%) |", m.registered, m.frames, 100 * m.share()) +
            (m.absolute ? format(" %.5f |", m.absolute->translation.rmse) : " - |") +
            cells(m.frame) + cells(m.second) + cells(m.all_pairs) + format(" %.1f |\n", m.seconds);
  return text;
}

std::string
toMarkdown(const std::vector<ScanResult>& scans, const std::vector<Variant>& variants)
{
  std::string text = "# bundle_icp_benchmark " BUNDLE_ICP_VERSION "\n\n";
  for (const Variant& variant : variants)
    text += "- `" + variant.name + "`: " + variant.description + "\n";
  text += "\nErrors are those of the frames that have a pose: ATE after rigid "
          "alignment and "
          "translation as RMSE, rotation\nas mean, as in the paper. Time is that to "
          "the poses, "
          "with all that a method needs.\n";
  for (const ScanResult& scan : scans) {
    text += "\n## " + scan.name + "\n";
    if (!scan.warning.empty())
      text += "\nWarning: " + scan.warning + ".\n";
    for (const ConditionResult& result : scan.conditions)
      text += "\n### " + toString(result.condition) + "\n\n" + toMarkdown(result);
    for (const Axis axis : {Axis::KEEP, Axis::BLUR})
      if (const auto conditions = curve(scan, axis); !conditions.empty())
        text += "\n### ATE and share of frames with a pose, by " + title(axis) + "\n\n" +
                curveTable(conditions, axis);
  }
  return text;
}

std::string
toJson(const std::vector<ScanResult>& scans)
{
  Json json{{"version", BUNDLE_ICP_VERSION}, {"scans", Json::array()}};
  for (const ScanResult& scan : scans) {
    Json conditions = Json::array();
    for (const ConditionResult& result : scan.conditions) {
      Json methods = Json::array();
      for (const Measurement& m : result.measurements)
        methods.push_back(toJson(m));
      conditions.push_back({{"keep", result.condition.keep},
                            {"blur_fraction", result.condition.blur},
                            {"methods", methods}});
    }
    Json warnings = Json::array();
    if (!scan.warning.empty())
      warnings.push_back(printable(scan.warning));
    json["scans"].push_back(
        {{"scan", printable(scan.name)}, {"warnings", warnings}, {"conditions", conditions}});
  }
  return json.dump(2) + "\n";
}

} // namespace bundle_icp
