// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "temporary_folder.h"

#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

/** What tests read in the Markdown pages of the repository. */
namespace pages {

/** Path of a file of the repository. */
inline std::string
inRepository(const std::string& path)
{
  return std::string(BUNDLE_ICP_SOURCE_FOLDER) + "/" + path;
}

/** All pages, as paths below the root of the repository. */
inline std::set<std::string>
all()
{
  std::set<std::string> paths{"README.md", "CONTRIBUTING.md", "CHANGELOG.md"};
  for (const auto& entry : boost::filesystem::directory_iterator(inRepository("docs")))
    if (entry.path().extension() == ".md")
      paths.insert("docs/" + entry.path().filename().string());
  return paths;
}

/** The fenced blocks of a language. */
inline std::vector<std::string>
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

/** The commands of the blocks for a shell, as lists of words without quotes. */
inline std::vector<std::vector<std::string>>
commandsOf(const std::string& text)
{
  std::vector<std::vector<std::string>> commands;
  for (const std::string& block : blocksOf(text, "bash")) {
    std::istringstream lines(block);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::vector<std::string> command;
      for (std::string word; words >> word && word[0] != '#';) {
        word = std::regex_replace(word, std::regex("'"), "");
        if (word != "&&" && word != "|") {
          command.push_back(word);
          continue;
        }
        commands.push_back(command);
        command.clear();
      }
      if (!command.empty())
        commands.push_back(command);
    }
  }
  return commands;
}

/** The first group of each match of an expression. */
inline std::set<std::string>
findAll(const std::string& text, const std::string& expression)
{
  const std::regex regex(expression);
  std::set<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), regex), end; match != end; ++match)
    found.insert((*match)[1]);
  return found;
}

} // namespace pages
