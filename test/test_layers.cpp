// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <boost/filesystem.hpp>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace fs = boost::filesystem;

namespace {

/** Rooms that each room DEPENDS on, as src/ROOM/CMakeLists.txt says. */
std::map<std::string, std::set<std::string>>
readDependencies()
{
  std::map<std::string, std::set<std::string>> dependencies;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(fs::path(BUNDLE_ICP_SOURCE_FOLDER) / "src")) {
    if (!fs::is_directory(entry.path()))
      continue;
    std::set<std::string>& below = dependencies[entry.path().filename().string()];
    std::ifstream stream((entry.path() / "CMakeLists.txt").string());
    bool are_dependencies = false;
    for (std::string word; stream >> word;)
      if (word == "DEPENDS" || word == "SOURCES")
        are_dependencies = word == "DEPENDS";
      else if (are_dependencies)
        below.insert(word);
  }
  return dependencies;
}

/** Room of a path below include/bundle_icp or src. */
std::string
roomOf(const std::string& path)
{
  const std::size_t slash = path.find('/');
  return slash == std::string::npos ? "scan" : path.substr(0, slash);
}

bool
isSource(const fs::path& path)
{
  const std::string extension = path.extension().string();
  return extension == ".h" || extension == ".hpp" || extension == ".cpp";
}

/** Headers of this project that a file includes from elsewhere than its own folder, as
 * paths below the root. */
std::vector<std::string>
includesOf(const fs::path& file)
{
  static const std::regex ours(R"(\s*#\s*include\s*(?:<bundle_icp/|")([^>"]+)[>"].*)");
  std::vector<std::string> headers;
  std::ifstream stream(file.string());
  for (std::string line; std::getline(stream, line);) {
    std::smatch match;
    if (std::regex_match(line, match, ours) && !fs::exists(file.parent_path() / match[1].str()))
      headers.push_back(match[1]);
  }
  return headers;
}

void
expectArrowsPointDown(const fs::path& root)
{
  const auto dependencies = readDependencies();
  std::size_t files = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root)) {
    if (!fs::is_regular_file(entry.path()) || !isSource(entry.path()))
      continue;
    ++files;
    const std::string path = fs::relative(entry.path(), root).generic_string();
    const std::string room = roomOf(path);
    ASSERT_EQ(dependencies.count(room), 1u) << path << " lies in no room";
    for (const std::string& header : includesOf(entry.path())) {
      const std::string other = roomOf(header);
      const bool generated = header == "export.h" || header == "version.h";
      EXPECT_TRUE(other == room || generated || dependencies.at(room).count(other))
          << path << " includes " << header;
    }
  }
  EXPECT_GT(files, 20u);
}

} // namespace

TEST(Layers, HeadersIncludeOnlyWhatLiesBelowThem)
{
  expectArrowsPointDown(fs::path(BUNDLE_ICP_SOURCE_FOLDER) / "include/bundle_icp");
}

TEST(Layers, SourcesIncludeOnlyWhatLiesBelowThem)
{
  expectArrowsPointDown(fs::path(BUNDLE_ICP_SOURCE_FOLDER) / "src");
}

TEST(Layers, PublicHeadersIncludeNoPrivateOnes)
{
  const fs::path root = fs::path(BUNDLE_ICP_SOURCE_FOLDER) / "include/bundle_icp";
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root))
    if (isSource(entry.path()))
      for (const std::string& header : includesOf(entry.path()))
        if (header != "export.h" && header != "version.h") {
          EXPECT_TRUE(fs::exists(root / header)) << entry.path() << ": " << header;
        }
}
