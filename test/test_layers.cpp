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

/** Which steps the files of a step may include, besides their own. `reconstruction` is
 * what lies in no step's folder. */
const std::map<std::string, std::set<std::string>> ALLOWED{
    {"common", {}},
    {"io", {"common"}},
    {"graph", {"common"}},
    {"registration", {"common"}},
    {"surface", {"common"}},
    {"tracking", {"common", "graph", "registration", "surface"}},
    {"simulation", {"common", "io"}}, // a synthetic scan is a dataset
    {"sparse", {"common", "io", "graph", "registration"}},
    {"evaluation", {"common", "io"}},
    {"reconstruction",
     {"common", "io", "graph", "registration", "surface", "tracking", "simulation", "sparse"}}};

/** Writing meshes and clouds is shared by all steps. */
bool
isFileHelper(const std::string& header)
{
  return header == "io/atomic_file.h" || header == "io/mesh_io.h";
}

/** Step of a path below include/bundle_icp or src. */
std::string
stepOf(const std::string& path)
{
  const std::size_t slash = path.find('/');
  return slash == std::string::npos ? "reconstruction" : path.substr(0, slash);
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
  std::size_t files = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root)) {
    if (!fs::is_regular_file(entry.path()) || !isSource(entry.path()))
      continue;
    ++files;
    const std::string path = fs::relative(entry.path(), root).generic_string();
    const std::string step = stepOf(path);
    ASSERT_EQ(ALLOWED.count(step), 1u) << path << " lies in no known step";
    for (const std::string& header : includesOf(entry.path())) {
      const std::string other = stepOf(header);
      const bool generated = header == "export.h" || header == "version.h";
      EXPECT_TRUE(other == step || generated || isFileHelper(header) ||
                  ALLOWED.at(step).count(other))
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
