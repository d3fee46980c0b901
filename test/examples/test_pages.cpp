// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What the Markdown pages name is there: files, scripts, options, and functions where
// docs/architecture.md says that they are.
#include "pages.h"
#include "program.h"

#include <gtest/gtest.h>

namespace {

bool
exists(const std::string& path)
{
  return boost::filesystem::exists(pages::inRepository(path));
}

/** Section of a page, from a heading to the next of its level. */
std::string
section(const std::string& text, const std::string& heading)
{
  const std::size_t begin = text.find("\n## " + heading + "\n");
  if (begin == std::string::npos)
    return "";
  return text.substr(begin, text.find("\n## ", begin + 1) - begin);
}

/** Long names of the options that a program prints with -h. */
std::set<std::string>
optionsOf(const std::string& program)
{
  return pages::findAll(runProgram(program, {"-h"}).out, R"(\n  (?:-\w \[ )?(--[\w-]+))");
}

} // namespace

TEST(Pages, LinkToFilesThatExist)
{
  for (const std::string& page : pages::all()) {
    const std::string folder = page.rfind("docs/", 0) == 0 ? "docs/" : "";
    for (const std::string& link :
         pages::findAll(readText(pages::inRepository(page)), R"(\]\(([^)#]+)[^)]*\))"))
      EXPECT_TRUE(link.find("://") != std::string::npos || exists(folder + link))
          << page << ": " << link;
  }
}

TEST(Pages, NamePathsThatExist)
{
  const std::string path = "`((?:src|include|test|examples|scripts|docs|cmake)/[\\w./-]+)`";
  for (const std::string& page : pages::all())
    for (const std::string& name : pages::findAll(readText(pages::inRepository(page)), path))
      EXPECT_TRUE(exists(name)) << page << ": " << name;
}

TEST(Pages, ArchitectureSaysWhereNamesAre)
{
  const std::string text = readText(pages::inRepository("docs/architecture.md"));
  const std::regex row("\\| `([^`|]+)` \\| `([^`|]+)` \\|\n");
  std::size_t count = 0;
  for (std::sregex_iterator match(text.begin(), text.end(), row), end; match != end; ++match) {
    const std::string name = (*match)[1], path = (*match)[2];
    const std::size_t colons = name.rfind("::");
    const std::regex last("\\b" + (colons == std::string::npos ? name : name.substr(colons + 2)) +
                          "\\b");
    const std::string source = readText(pages::inRepository(path));
    EXPECT_TRUE(std::regex_search(source, last)) << name << " in " << path;
    ++count;
  }
  EXPECT_GE(count, 30u);
}

TEST(Pages, RunScriptsThatBashCanParse)
{
  for (const std::string& page : pages::all())
    for (const std::vector<std::string>& command :
         pages::commandsOf(readText(pages::inRepository(page))))
      for (const std::string& word : command) {
        if (word.rfind("scripts/", 0) != 0)
          continue;
        EXPECT_TRUE(exists(word)) << page << ": " << word;
        if (boost::filesystem::path(word).extension() == ".sh") {
          EXPECT_EQ(std::system(("bash -n '" + pages::inRepository(word) + "'").c_str()), 0)
              << word;
        }
      }
}

TEST(Pages, GiveProgramsOptionsThatTheyHave)
{
  for (const std::string& page : pages::all())
    for (const std::vector<std::string>& command :
         pages::commandsOf(readText(pages::inRepository(page)))) {
      const std::string& program = command.front();
      if (program.rfind("bundle_icp_", 0) != 0)
        continue;
      if (!hasProgram(program))
        GTEST_SKIP() << program << " is not built";
      const std::set<std::string> options = optionsOf(program);
      for (const std::string& word : command)
        EXPECT_TRUE(word.rfind("--", 0) != 0 || options.count(word))
            << page << ": " << program << " " << word;
    }
}

TEST(Pages, ListEveryOptionOfEveryProgram)
{
  const std::string text = readText(pages::inRepository("docs/options.md"));
  for (const char* const name : {"benchmark", "evaluate", "reconstruct", "simulate"}) {
    const std::string program = std::string("bundle_icp_") + name;
    if (!hasProgram(program))
      GTEST_SKIP() << program << " is not built";
    EXPECT_EQ(pages::findAll(section(text, program), R"(\n\| `(?:-\w, )?(--[\w-]+))"),
              optionsOf(program))
        << "docs/options.md is not what scripts/options.sh makes";
  }
}
