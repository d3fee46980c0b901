// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Code that is shown compiles: every block of the readme is a copy of a part of an
// example.
#include "temporary_folder.h"

#include <gtest/gtest.h>

#include <vector>

namespace {

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

/** The fenced blocks of a language. */
std::vector<std::string>
blocksOf(const std::string& text, const std::string& language)
{
  const std::string begin = "\n```" + language + "\n", end = "\n```\n";
  std::vector<std::string> blocks;
  for (std::size_t at = text.find(begin); at != std::string::npos; at = text.find(begin, at + 1)) {
    const std::size_t first = at + begin.size();
    blocks.push_back(text.substr(first, text.find(end, first) + 1 - first));
  }
  return blocks;
}

std::string
allExamples(const std::string& extension)
{
  std::string text;
  const std::string folder = std::string(BUNDLE_ICP_SOURCE_FOLDER) + "/examples";
  for (const auto& entry : boost::filesystem::recursive_directory_iterator(folder))
    if (entry.path().extension() == extension)
      text += withoutIndentation(readText(entry.path().string()));
  return text;
}

} // namespace

TEST(Readme, ShowsCodeOfTheExamples)
{
  const std::string readme = readText(std::string(BUNDLE_ICP_SOURCE_FOLDER) + "/README.md");
  for (const auto& [language, extension] :
       {std::make_pair("cpp", ".cpp"), std::make_pair("cmake", ".txt")}) {
    const std::vector<std::string> blocks = blocksOf(readme, language);
    EXPECT_FALSE(blocks.empty()) << language;
    const std::string examples = allExamples(extension);
    for (const std::string& block : blocks)
      EXPECT_NE(examples.find(withoutIndentation(block)), std::string::npos) << block;
  }
}
