// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// -h of every program: each option, on the output stream, with exit code 0.
#include "messages.h"
#include "program.h"

#include <bundle_icp/version.h>

#include <gtest/gtest.h>

#include <map>

namespace {

const std::map<std::string, std::vector<std::string>> options_of = {
    {"benchmark",
     {"SCAN...", "-o [ --output ]", "--methods", "--ablations", "--keep", "--blur-fraction",
      "--seed", "--stride", "--max-frames", "--shuffle", "--intrinsics", "--depth-scale",
      "--sensor", "--threads", "-q [ --quiet ]", "[m]", "[px]"}},
    {"check",
     {"SCAN", "--frames", "--threads", "--intrinsics", "--depth-scale", "--max-time-difference",
      "--stride", "[px]", "[s]"}},
    {"merge", {"RESULT RESULT... -o OUT", "--voxel-size", "--stride", "--threads"}},
    {"reconstruct",
     {"SCAN",
      "-o [ --output ]",
      "--voxel-size",
      "--truncation",
      "--roi",
      "--min-depth",
      "--max-depth",
      "--stride",
      "--max-frames",
      "--shuffle",
      "--method",
      "--max-features",
      "--solver",
      "--matching",
      "--threads",
      "--device",
      "--no-mesh",
      "--intrinsics",
      "--depth-scale",
      "--calibration FILE",
      "--known-distance MEASURED,TRUE",
      "--no-calibration",
      "--pose-prior FILE[,SIGMA]",
      "--poses FILE",
      "-q [ --quiet ]",
      "[m]",
      "[px]"}},
    {"evaluate",
     {"GROUNDTRUTH", "TRAJECTORY", "--json", "--frames", "--max-difference", "--mesh", "--surface",
      "--complete-within", "--threads", "[s]", "[m]"}},
    {"simulate",
     {"OUT",
      "--frames",
      "--rate",
      "--size",
      "--focal-length",
      "--seed",
      "--surface-spacing",
      "--threads",
      "-q [ --quiet ]",
      "--full-noise",
      "--noise",
      "--quantisation",
      "--holes",
      "--flying-pixels",
      "--color-noise",
      "--blur",
      "--exposure-change",
      "--depth-bias",
      "--focal-error",
      "--time-offset",
      "--readout",
      "--unordered",
      "[px]",
      "[m]",
      "[s]"}},
};

} // namespace

TEST(Help, PrintsEveryOption)
{
  for (const auto& [name, options] : options_of) {
    const std::string program = "bundle_icp_" + name;
    if (!hasProgram(program))
      GTEST_SKIP() << program << " is not built";
    const ProgramResult result = runProgram(program, {"-h"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    EXPECT_CONTAINS(result.out, "Usage: " + program);
    for (const std::string& option : options)
      EXPECT_CONTAINS(result.out, option);
    EXPECT_EQ(runProgram(program, {"--help"}).out, result.out);
    EXPECT_EQ(runProgram(program, {"--version"}).out, program + " " BUNDLE_ICP_VERSION "\n");
  }
}
