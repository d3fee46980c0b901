// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// bundle_icp_reconstruct that is killed at any moment: the folder of the results stays whole.
#include "results.h"

#include <boost/crc.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <random>
#include <sys/wait.h>
#include <unistd.h>

namespace {

class ReconstructKilled : public ReconstructProgram {
protected:
  std::vector<std::string>
  arguments(const std::string& voxel_size) const
  {
    return {scan, "-o", out, "-q", "--threads", "1", "--voxel-size", voxel_size};
  }

  /** Starts a run and kills it after a time, unless it has ended. */
  void
  runAndKill(const std::string& voxel_size, std::chrono::microseconds time) const
  {
    const std::string program = std::string(BUNDLE_ICP_PROGRAM_FOLDER) + "/bundle_icp_reconstruct";
    std::vector<std::string> words = arguments(voxel_size);
    words.insert(words.begin(), program);
    std::vector<char*> raw;
    for (std::string& word : words)
      raw.push_back(word.data());
    raw.push_back(nullptr);
    const pid_t child = fork();
    if (child == 0) {
      for (std::FILE* const stream : {stdout, stderr})
        if (!std::freopen("/dev/null", "w", stream))
          _exit(126);
      execv(program.c_str(), raw.data());
      _exit(127);
    }
    usleep(useconds_t(time.count()));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  }

  /** Whether every file has the size and the checksum that the report says. */
  bool
  isWhole() const
  {
    const nlohmann::json files = report()["files"];
    return files.size() > 4 && std::all_of(files.begin(), files.end(), [this](const auto& file) {
             const std::string bytes =
                 readText(out + "/" + file["name"].template get<std::string>());
             boost::crc_32_type crc;
             crc.process_bytes(bytes.data(), bytes.size());
             return file["bytes"] == bytes.size() && file["crc32"] == crc.checksum();
           });
  }
};

} // namespace

TEST_F(ReconstructKilled, TheSameCommandGoesOn)
{
  simulate();
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(runProgram("bundle_icp_reconstruct", arguments("0.02")).exit_code, 0);
  const auto whole_run = std::chrono::duration_cast<std::chrono::microseconds>(
      std::chrono::steady_clock::now() - start);
  const std::string poses = readText(out + "/trajectory.txt"), mesh = readText(out + "/mesh.ply");
  std::mt19937 random(2);
  std::uniform_real_distribution<double> share(0, 1);
  for (int k = 0; k < 10; ++k) {
    boost::filesystem::remove_all(out);
    const auto time =
        std::chrono::microseconds(std::int64_t(share(random) * double(whole_run.count())));
    runAndKill("0.02", time);
    const ProgramResult result = runProgram("bundle_icp_reconstruct", arguments("0.02"));
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(readText(out + "/trajectory.txt") == poses) << "kill after " << time.count();
    EXPECT_TRUE(readText(out + "/mesh.ply") == mesh) << "kill after " << time.count();
  }
}

TEST_F(ReconstructKilled, TheFolderIsWhollyOldOrWhollyNew)
{
  simulate();
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(runProgram("bundle_icp_reconstruct", arguments("0.02")).exit_code, 0);
  const auto whole_run = std::chrono::duration_cast<std::chrono::microseconds>(
      std::chrono::steady_clock::now() - start);
  ASSERT_TRUE(isWhole());
  const std::set<std::string> names = namesIn(out);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0, 1.2);
  constexpr int num_kills = 30;
  int is_new = 0;
  std::string voxel_sizes[] = {"0.02", "0.03"};
  for (int k = 0; k < num_kills; ++k) {
    const auto time =
        std::chrono::microseconds(std::int64_t(share(random) * double(whole_run.count())));
    runAndKill(voxel_sizes[1], time);
    ASSERT_TRUE(isWhole()) << "kill " << k << " after " << time.count() << " us";
    const nlohmann::json content = report();
    const double voxel_size = content["options"]["voxel_size"];
    ASSERT_TRUE(voxel_size == 0.02 || voxel_size == 0.03);
    if (voxel_size == std::stod(voxel_sizes[1])) {
      ++is_new;
      std::swap(voxel_sizes[0], voxel_sizes[1]);
    }
  }
  RecordProperty("new_results", is_new);
  ASSERT_EQ(runProgram("bundle_icp_reconstruct", arguments("0.02")).exit_code, 0);
  EXPECT_EQ(namesIn(out), names) << "nothing of the killed runs is left";
}
