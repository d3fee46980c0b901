// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "judge.h"
#include "program.h"

#include <bundle_icp/evaluation/trajectory_error.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <regex>
#include <sstream>
#include <stdexcept>

namespace adversity {
namespace {

using nlohmann::json;

std::vector<Eigen::Vector3d>
readPositions(const std::string& file)
{
  std::vector<Eigen::Vector3d> positions;
  std::istringstream lines(readText(file));
  for (std::string line; std::getline(lines, line);) {
    double stamp = 0;
    Eigen::Vector3d p;
    if (line[0] != '#' && std::istringstream(line) >> stamp >> p.x() >> p.y() >> p.z())
      positions.push_back(p);
  }
  return positions;
}

/** Relates each pose to its image, whatever its stamp says: both are in the order of stamps. */
void
measure(const json& report, const std::string& folder, const std::string& output,
        const Places& places, Outcome& outcome)
{
  std::vector<json> frames;
  for (const json& frame : report.at("frames"))
    if (frame.at("registered") && frame.at("component") == 0)
      frames.push_back(frame);
  std::stable_sort(frames.begin(), frames.end(), [](const json& a, const json& b) {
    return a.at("timestamp").get<double>() < b.at("timestamp").get<double>();
  });
  const std::vector<Eigen::Vector3d> positions = readPositions(output + "/trajectory.txt");
  if (positions.size() != frames.size())
    throw std::runtime_error(output + ": report.json and trajectory.txt differ");
  bundle_icp::Trajectory truth(frames.size()), estimate(frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string file = frames[i].at("name").get<std::string>().substr(folder.size() + 1);
    truth[i].timestamp = estimate[i].timestamp = double(i);
    truth[i].world_from_camera.translation() = places.at(file);
    estimate[i].world_from_camera.translation() = positions[i];
  }
  outcome.num_poses = frames.size();
  if (const auto error = bundle_icp::absoluteTrajectoryError(truth, estimate))
    outcome.error = error->translation.rmse;
}

/** What is said above a note. */
std::string
warnings(const json& report)
{
  std::string text;
  for (const json& finding : report.at("findings"))
    if (finding.at("severity") != "note")
      text += finding.at("severity").get<std::string>() + ": " +
              finding.at("what").get<std::string>() + "; " + finding.value("remedy", "") + "\n";
  return text;
}

} // namespace

const char*
toString(Judgement judgement)
{
  switch (judgement) {
  case Judgement::RIGHT:
    return "right";
  case Judgement::NAMED:
    return "named";
  case Judgement::MISSED:
    return "MISSED";
  case Judgement::SILENT_FAULT:
    return "SILENT FAULT";
  case Judgement::CRASHED:
    return "CRASHED";
  }
  return "";
}

Outcome
reconstruct(const std::string& folder, const std::string& output, const Places& places,
            const std::vector<std::string>& arguments, const std::string& limits)
{
  std::vector<std::string> all = {folder, "-o", output, "--no-mesh", "--threads", "1", "--quiet"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  const ProgramResult result = runProgram("bundle_icp_reconstruct", all, limits);
  writeText(output + "/said.txt", result.err + result.out);
  Outcome outcome;
  outcome.exit_code = result.exit_code;
  outcome.messages = result.err;
  if (result.exit_code == 0 || result.exit_code == 3) {
    const json report = json::parse(readText(output + "/report.json"));
    outcome.verdict = report.at("verdict");
    outcome.messages = warnings(report);
    measure(report, folder, output, places, outcome);
  }
  return outcome;
}

double
largestError(double reference)
{
  return 2 * reference + 0.001;
}

Judgement
judge(const Input& input, const Outcome& outcome, std::size_t num_colors, double largest_error)
{
  const bool is_done = outcome.exit_code == 0;
  if (!is_done && outcome.exit_code != 1 && outcome.exit_code != 3)
    return Judgement::CRASHED;
  const bool is_wrong = outcome.error && *outcome.error > largest_error;
  if (is_done && is_wrong)
    return Judgement::SILENT_FAULT;
  const double share = double(outcome.num_poses) / double(num_colors);
  if (is_done && outcome.error && share >= input.least_share)
    return Judgement::RIGHT;
  const bool is_named =
      !input.cause.empty() &&
      std::regex_search(outcome.messages,
                        std::regex(input.cause, std::regex::ECMAScript | std::regex::icase));
  return is_named ? Judgement::NAMED : Judgement::MISSED;
}

} // namespace adversity
