// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "temporary_folder.h"

#include <cstdlib>
#include <string>
#include <sys/wait.h>
#include <vector>

/** What a program did. */
struct ProgramResult {
  int exit_code = -1; ///< -1 when it ended by a signal
  std::string out, err;
};

/** True when the programs are built beside the tests. */
inline bool
hasProgram(const std::string& name)
{
  return boost::filesystem::exists(std::string(BUNDLE_ICP_PROGRAM_FOLDER) + "/" + name);
}

/** Runs a program of the project, for example "bundle_icp_evaluate", to its end.
 *  \param before text of the shell before the command, such as limits */
inline ProgramResult
runProgram(const std::string& name, const std::vector<std::string>& arguments,
           const std::string& before = "")
{
  const TemporaryFolder folder;
  const auto quote = [](const std::string& word) {
    std::string quoted = "'";
    for (const char c : word)
      quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
  };
  std::string command = before + quote(std::string(BUNDLE_ICP_PROGRAM_FOLDER) + "/" + name);
  for (const std::string& argument : arguments)
    command += " " + quote(argument);
  command += " </dev/null >" + quote(folder.path("out")) + " 2>" + quote(folder.path("err"));
  const int status = std::system(command.c_str());
  ProgramResult result;
  if (WIFEXITED(status))
    result.exit_code = WEXITSTATUS(status);
  result.out = readText(folder.path("out"));
  result.err = readText(folder.path("err"));
  return result;
}
