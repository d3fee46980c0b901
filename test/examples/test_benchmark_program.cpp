// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// bundle_icp_benchmark on a simulated scan: tables, files and refusals.
#include "messages.h"
#include "results.h"

namespace {

class BenchmarkProgram : public ::testing::Test {
protected:
  void
  SetUp() override
  {
    for (const char* const name : {"bundle_icp_benchmark", "bundle_icp_simulate"})
      if (!hasProgram(name))
        GTEST_SKIP() << name << " is not built";
    const ProgramResult result = runProgram(
        "bundle_icp_simulate", {scan, "--frames", "8", "--size", "240x180", "--focal-length", "197",
                                "--surface-spacing", "0", "-q"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  ProgramResult
  benchmark(std::vector<std::string> options)
  {
    options.push_back("-q");
    return runProgram("bundle_icp_benchmark", options);
  }

  TemporaryFolder folder;
  std::string scan = folder.path("scan"), out = folder.path("out");
};

const std::vector<std::string> METHODS{"f2m_icp", "visual_icp", "rgbd_sfm", "bundle_icp"};
const std::vector<std::string> ABLATIONS{
    "no virtual depth", "no visual start",     "no global adjustment",        "no dense terms",
    "no motion prior",  "no self-calibration", "no depth error of each image"};

} // namespace

TEST_F(BenchmarkProgram, ComparesMethodsAndAblations)
{
  const ProgramResult result = benchmark({scan, "-o", out, "--ablations"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(namesIn(out), (std::set<std::string>{"benchmark.json", "benchmark.md"}));
  const std::string markdown = readText(out + "/benchmark.md");
  const auto json = nlohmann::json::parse(readText(out + "/benchmark.json"));
  EXPECT_EQ(json["scans"][0]["scan"], "scan");
  const auto& conditions = json["scans"][0]["conditions"];
  ASSERT_EQ(conditions.size(), 1u);
  const auto& methods = conditions[0]["methods"];
  ASSERT_EQ(methods.size(), 11u);
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const auto& method = methods[i];
    const std::string name = i < 4 ? METHODS[i] : ABLATIONS[i - 4];
    EXPECT_EQ(method["method"], name);
    EXPECT_CONTAINS(result.out, "| " + name + " | 8 of 8 (100 %) |");
    EXPECT_CONTAINS(markdown, "| " + name + " | 8 of 8 (100 %) |");
    EXPECT_EQ(method["frames_with_pose"], 8) << name;
    EXPECT_LT(method["ate_m"]["rmse"], 0.005) << name; // exact depth in small images
    EXPECT_GT(method["time_s"], 0) << name;
    for (const char* const key : {"rpe_frame", "rpe_all_pairs"})
      EXPECT_LT(method[key]["translation_m"]["rmse"], 0.01) << name << " " << key;
  }
}

TEST_F(BenchmarkProgram, TabulatesCurves)
{
  const ProgramResult result =
      benchmark({scan, "-o", out, "--methods", "f2m_icp,rgbd_sfm", "--keep", "2,1",
                 "--blur-fraction", "0,0.5", "--threads", "2"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(readText(out + "/benchmark.json"));
  const auto& conditions = json["scans"][0]["conditions"];
  ASSERT_EQ(conditions.size(), 3u); // every frame without blur belongs to both curves
  EXPECT_EQ(conditions[0]["methods"][0]["frames"], 4);
  EXPECT_EQ(conditions[2]["blur_fraction"], 0.5);
  const std::string markdown = readText(out + "/benchmark.md");
  EXPECT_CONTAINS(markdown, "### every 2nd frame");
  EXPECT_CONTAINS(markdown, "### every frame, 50 % blurred");
  EXPECT_CONTAINS(markdown, "| every n-th frame | f2m_icp | rgbd_sfm |");
  EXPECT_CONTAINS(markdown, "| blurred images [%] | f2m_icp | rgbd_sfm |");
}

TEST_F(BenchmarkProgram, WarnsOfPosesThatADeviceEstimated)
{
  const std::string place = folder.path("estimated");
  ASSERT_EQ(runProgram("bundle_icp_simulate",
                       {place, "--frames", "6", "--size", "240x180", "--focal-length", "197",
                        "--surface-spacing", "0", "-q", "--format", "scannet"})
                .exit_code,
            0);
  const ProgramResult result = benchmark({place, scan, "-o", out, "--methods", "f2m_icp"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string warning = "that BundleFusion estimated, not measured truth";
  EXPECT_CONTAINS(result.err, warning);
  EXPECT_CONTAINS(readText(out + "/benchmark.md"), warning);
  const auto json = nlohmann::json::parse(readText(out + "/benchmark.json"));
  ASSERT_EQ(json["scans"][0]["warnings"].size(), 1u);
  EXPECT_CONTAINS(json["scans"][0]["warnings"][0].get<std::string>(), warning);
  EXPECT_TRUE(json["scans"][1]["warnings"].empty());
}

TEST_F(BenchmarkProgram, RefusesWhatItCannotCompare)
{
  const auto expect = [this](std::vector<std::string> options, int exit_code,
                             const std::string& message) {
    const ProgramResult result = benchmark(std::move(options));
    EXPECT_EQ(result.exit_code, exit_code) << message;
    EXPECT_CONTAINS(result.err, message);
    EXPECT_EQ(result.out, "");
  };
  expect({}, 2, "expected SCAN...");
  expect({scan, "--methods", "f2m_icp,slam"}, 2,
         "--methods f2m_icp,slam: known are f2m_icp, visual_icp, rgbd_sfm and bundle_icp");
  expect({scan, "--keep", "2,x"}, 2, "--keep 2,x: expected numbers separated by commas");
  expect({scan, "--keep", "0"}, 2, "--keep: each number must be at least 1");
  expect({scan, "--blur-fraction", "1.5"}, 2, "each number must lie in 0 ... 1");
  expect({scan, "--stride", "-1"}, 2, "--stride -1: must not be negative");
  expect({folder.path("none")}, 1, folder.path("none"));
  boost::filesystem::remove(scan + "/groundtruth.txt");
  expect({scan, "-o", out}, 1, scan + ": the recording holds no true poses to compare with");
  EXPECT_FALSE(boost::filesystem::exists(out));
}
