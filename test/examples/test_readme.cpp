// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// The readme is short, its code is a copy of a part of an example, and its commands work.
#include "pages.h"
#include "results.h"

#include <algorithm>

namespace {

std::string
readme()
{
  return readText(pages::inRepository("README.md"));
}

std::string
withoutIndentation(const std::string& text)
{
  std::istringstream lines(text);
  std::string line, result;
  while (std::getline(lines, line)) {
    const std::size_t begin = line.find_first_not_of(' ');
    result += (begin == std::string::npos ? "" : line.substr(begin)) + "\n";
  }
  return result;
}

std::string
allExamples(const std::string& extension)
{
  std::string text;
  for (const auto& entry :
       boost::filesystem::recursive_directory_iterator(pages::inRepository("examples")))
    if (entry.path().extension() == extension)
      text += withoutIndentation(readText(entry.path().string()));
  return text;
}

bool
isProgram(const std::vector<std::string>& command)
{
  return command.front().rfind("bundle_icp_", 0) == 0;
}

/** Runs the commands of the readme on a small simulated scan. */
class ReadmeCommands : public ReconstructProgram {
protected:
  ProgramResult
  run(const std::vector<std::string>& command) const
  {
    std::vector<std::string> arguments;
    for (auto word = command.begin() + 1; word != command.end(); ++word) {
      std::string argument = std::regex_replace(*word, std::regex("^SCAN"), scan);
      arguments.push_back(std::regex_replace(argument, std::regex("^OUT"), out));
    }
    return runProgram(command.front(), arguments);
  }
};

} // namespace

TEST(Readme, HasAtMost150Lines)
{
  const std::string text = readme();
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 150);
}

TEST(Readme, ShowsCodeOfTheExamples)
{
  for (const auto& [language, extension] :
       {std::make_pair("cpp", ".cpp"), std::make_pair("cmake", ".txt")}) {
    const std::vector<std::string> blocks = pages::blocksOf(readme(), language);
    EXPECT_FALSE(blocks.empty()) << language;
    const std::string examples = allExamples(extension);
    for (const std::string& block : blocks)
      EXPECT_NE(examples.find(withoutIndentation(block)), std::string::npos) << block;
  }
}

TEST(Readme, HasCommandsThatTestsKnow)
{
  // The tests themselves were configured and built so, and test/install installs.
  const std::vector<std::vector<std::string>> build = {
      {"cmake", "-S", ".", "-B", "build", "-G", "Ninja"},
      {"cmake", "--build", "build"},
      {"sudo", "cmake", "--install", "build"}};
  for (const std::vector<std::string>& command : pages::commandsOf(readme())) {
    const bool is_script = command.size() == 2 && command[0] == "bash"; // see test_pages.cpp
    const bool is_build = std::find(build.begin(), build.end(), command) != build.end();
    EXPECT_TRUE(isProgram(command) || is_script || is_build) << command.front();
  }
}

TEST_F(ReadmeCommands, WorkOnASimulatedScan)
{
  simulate();
  std::size_t count = 0;
  for (const std::vector<std::string>& command : pages::commandsOf(readme()))
    if (isProgram(command)) {
      if (!hasProgram(command.front()))
        GTEST_SKIP() << command.front() << " is not built";
      const ProgramResult result = run(command);
      EXPECT_EQ(result.exit_code, 0) << command.front() << ": " << result.err;
      ++count;
    }
  EXPECT_GE(count, 2u);
}

TEST_F(ReadmeCommands, WriteTheFilesOfItsTable)
{
  simulate();
  ASSERT_EQ(run({"bundle_icp_reconstruct", "SCAN", "-o", "OUT"}).exit_code, 0);
  const std::string text = readme();
  const std::size_t begin = text.find("`OUT` then holds:");
  ASSERT_NE(begin, std::string::npos);
  const std::string table = text.substr(begin, text.find("\n\nThe world frame", begin) - begin);
  std::set<std::string> names;
  for (const std::string& row : pages::findAll(table, R"(\n\| (`[^|]*)\|)"))
    for (const std::string& name : pages::findAll(row, "`([^`]+)`"))
      names.insert(name);
  EXPECT_EQ(names, namesIn(out));
}
