// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <set>
#include <string>
#include <vector>

/** A scan to reconstruct, and a folder for the results. */
class ReconstructProgram : public ::testing::Test {
protected:
  void
  SetUp() override
  {
    for (const char* const name : {"bundle_icp_reconstruct", "bundle_icp_simulate"})
      if (!hasProgram(name))
        GTEST_SKIP() << name << " is not built";
  }

  /** A scan of 12 small images, from which a mesh can be made within seconds. */
  void
  simulate(const std::string& format = "tum")
  {
    const ProgramResult result = runProgram(
        "bundle_icp_simulate", {scan, "--frames", "12", "--size", "320x240", "--focal-length",
                                "262", "--surface-spacing", "0", "-q", "--format", format});
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  /** Reconstructs `scan` to `out`, with coarse voxels for speed. */
  ProgramResult
  reconstruct(std::vector<std::string> options = {})
  {
    options.insert(options.begin(), {scan, "-o", out, "-q", "--voxel-size", "0.02"});
    return runProgram("bundle_icp_reconstruct", options);
  }

  nlohmann::json
  report() const
  {
    return nlohmann::json::parse(readText(out + "/report.json"));
  }

  TemporaryFolder folder;
  std::string scan = folder.path("scan"), out = folder.path("out");
};

/** Names of everything in a folder, hidden files included. */
inline std::set<std::string>
namesIn(const std::string& folder)
{
  std::set<std::string> names;
  for (const auto& entry : boost::filesystem::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}
