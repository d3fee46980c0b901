// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// bundle_icp_reconstruct with a camera that is not what it is said to be: what is
// estimated, reported, and taken from an earlier scan.
#include <bundle_icp/io/trajectory.h>

#include "messages.h"
#include "recordings.h"
#include "results.h"

using namespace bundle_icp;

namespace {

class ReconstructCalibration : public ReconstructProgram {
protected:
  /** A scan whose focal length is said to be 2 % longer than it is. */
  void
  simulate(const char* frames)
  {
    const ProgramResult result =
        runProgram("bundle_icp_simulate",
                   {scan, "--frames", frames, "--rate", "5", "--size", "320x240", "--focal-length",
                    "262", "--focal-error", "0.02", "--surface-spacing", "0", "-q"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  /** Runs without a mesh; the program's error stream. */
  std::string
  run(std::vector<std::string> options = {})
  {
    options.push_back("--no-mesh");
    const ProgramResult result = reconstruct(options);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.err;
  }

  /** A run that must fail; the program's error stream. */
  std::string
  failure(const std::vector<std::string>& options, int exit_code)
  {
    const ProgramResult result = reconstruct(options);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_EQ(result.out, "");
    return result.err;
  }

  Trajectory
  trajectory() const
  {
    return readTrajectory(out + "/trajectory.txt");
  }

  nlohmann::json
  calibration() const
  {
    return report()["calibration"];
  }

  std::string file = folder.path("calibration.json");
};

/** Distance between first and last camera [m]. */
double
extent(const Trajectory& trajectory)
{
  return (trajectory.back().world_from_camera.translation() -
          trajectory.front().world_from_camera.translation())
      .norm();
}

std::size_t
numApplied(const nlohmann::json& calibration)
{
  std::size_t count = 0;
  for (const auto& test : calibration["tests"])
    count += test["applied"].get<bool>();
  for (const auto& parameter : calibration["parameters"])
    count += parameter["applied"].get<bool>();
  return count;
}

} // namespace

TEST_F(ReconstructCalibration, IsFoundReportedAndUsedAgain)
{
  simulate("20");
  EXPECT_CONTAINS(run(), "calibration: focal_x -0.0");
  const nlohmann::json json = calibration();
  const auto& focal = json["parameters"]["focal_x"];
  EXPECT_NEAR(focal["value"].get<double>(), 1 / 1.02 - 1, 0.005);
  EXPECT_GT(focal["deviation"].get<double>(), 0);
  EXPECT_EQ(focal["unit"], "1");
  EXPECT_EQ(focal["applied"], true);
  EXPECT_EQ(focal["estimated"], true);
  EXPECT_NEAR(json["nominal_camera"]["fx"].get<double>(), 1.02 * 262, 1e-9);
  EXPECT_NEAR(json["corrected_camera"]["fx"].get<double>(), 262, 1.3);
  EXPECT_EQ(json["depth_scale"]["value"], 1);
  EXPECT_CONTAINS(json["depth_scale"]["remark"].get<std::string>(), "nominal");
  EXPECT_EQ(json["tests"].size(), 9u);
  for (const auto& test : json["tests"]) {
    EXPECT_EQ(test["applied"].get<bool>(), test["name"] == "focal length") << test;
    EXPECT_TRUE(test["gain"].is_number() && test["significance"].is_number());
  }
  const Trajectory first = trajectory();

  boost::filesystem::copy_file(out + "/calibration.json", file);
  EXPECT_CONTAINS(run({"--calibration", file}), "calibration: focal_x -0.0");
  const nlohmann::json again = calibration();
  EXPECT_EQ(again["parameters"]["focal_x"]["value"], focal["value"]);
  EXPECT_EQ(again["parameters"]["focal_x"]["applied"], true);
  EXPECT_EQ(again["parameters"]["focal_x"]["estimated"], false);
  ASSERT_EQ(again["tests"].size(), 1u);
  EXPECT_EQ(again["tests"][0]["name"], "depth error of each image");
  const Trajectory second = trajectory();
  ASSERT_EQ(second.size(), first.size());
  for (std::size_t i = 0; i < first.size(); ++i)
    EXPECT_TRUE(second[i].world_from_camera.isApprox(first[i].world_from_camera, 5e-4)) << i;

  run({"--calibration", file, "--no-calibration", "--max-frames", "9"});
  EXPECT_EQ(calibration()["parameters"]["focal_x"]["value"], focal["value"]);
  EXPECT_TRUE(calibration()["tests"].empty());
}

TEST_F(ReconstructCalibration, NothingIsEstimatedOnRequest)
{
  simulate("9");
  EXPECT_EQ(run({"--no-calibration"}), "");
  EXPECT_EQ(numApplied(calibration()), 0u);
  EXPECT_EQ(calibration()["depth_error_of_each_image"], false);
  EXPECT_EQ(calibration()["corrected_camera"], calibration()["nominal_camera"]);
}

TEST_F(ReconstructCalibration, AKnownDistanceScalesTheTrajectory)
{
  simulate("7"); // too few to estimate anything
  run();
  const double before = extent(trajectory());
  EXPECT_CONTAINS(run({"--known-distance", "1,1.05"}), "calibration: depth_scale 1.05");
  EXPECT_NEAR(extent(trajectory()), 1.05 * before, 2e-3 * before);
  EXPECT_EQ(calibration()["depth_scale"]["value"], 1.05);
  EXPECT_CONTAINS(calibration()["depth_scale"]["remark"].get<std::string>(),
                  "from a known distance");
  // The next scan takes it from the file, and another distance refines it.
  boost::filesystem::copy_file(out + "/calibration.json", file);
  run({"--calibration", file});
  EXPECT_NEAR(extent(trajectory()), 1.05 * before, 2e-3 * before);
  EXPECT_CONTAINS(calibration()["depth_scale"]["remark"].get<std::string>(),
                  "from a calibration file");
  run({"--calibration", file, "--known-distance", "1.05,1"});
  EXPECT_NEAR(extent(trajectory()), before, 2e-3 * before);
}

TEST_F(ReconstructCalibration, AKnownDistanceKeepsWhatWasEstimated)
{
  simulate("7");
  run({"--intrinsics", "estimate", "--known-distance", "1,1.05"});
  std::string kinds;
  const nlohmann::json content = report();
  for (const auto& finding : content["findings"])
    kinds += finding["kind"].get<std::string>() + " ";
  EXPECT_CONTAINS(kinds, "estimated_intrinsics");
}

TEST_F(ReconstructCalibration, RefusesBadFiles)
{
  recordings::writeTum(scan, 3, {320, 240});
  const auto error = [this] { return failure({"--calibration", file}, 1); };
  EXPECT_CONTAINS(error(), "calibration.json: cannot be opened: No such file");
  writeText(file, "focal_x 0.02");
  EXPECT_CONTAINS(error(), "calibration.json: is not a JSON object");
  nlohmann::json json{{"camera", {{"width", 640}, {"height", 480}}}};
  writeText(file, json.dump());
  EXPECT_CONTAINS(error(), "calibration.json: made for images of 640x480, not 320x240");
  json["camera"] = {{"width", 320}, {"height", 240}, {"fx", 60},
                    {"fy", 60},     {"cx", 160},     {"cy", 120}};
  for (const auto& [parameter, reason] : std::vector<std::pair<nlohmann::json, std::string>>{
           {{{"zoom", {{"value", 1}}}}, "'zoom' is not a parameter"},
           {{{"readout", {{"value", "fast"}}}}, "readout: value is not a number"},
           {{{"readout", {{"value", 3}}}}, "readout must lie within +-0.1"}}) {
    json["parameters"] = parameter;
    writeText(file, json.dump());
    EXPECT_CONTAINS(error(), "calibration.json: " + reason);
  }
  // Each value by itself is possible.
  json["parameters"] = nlohmann::json::object();
  json["depth_scale"] = 1.5;
  writeText(file, json.dump());
  EXPECT_CONTAINS(failure({"--calibration", file, "--known-distance", "1,1.5"}, 2),
                  "depth_scale must lie in (0.5, 2)");
  EXPECT_FALSE(boost::filesystem::exists(out));
}

TEST_F(ReconstructCalibration, RefusesWrongUsage)
{
  for (const char* const bad : {"1", "1,", "1;2", "1,2,3", "0,1", "1,-1", "1,nan", "a,b"})
    EXPECT_CONTAINS(failure({"--known-distance", bad}, 2),
                    std::string("--known-distance ") + bad + ": expected MEASURED,TRUE");
  EXPECT_CONTAINS(failure({"--known-distance", "1,3"}, 2), "differ by a factor of 2");
  EXPECT_CONTAINS(failure({"--calibration", file, "--method", "f2m_icp"}, 2),
                  "--calibration: only the method bundle_icp");
}
