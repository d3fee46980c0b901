// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <boost/filesystem.hpp>

#include <fstream>
#include <sstream>
#include <string>

/** A folder that is removed with its content at the end of its life. */
class TemporaryFolder {
public:
  TemporaryFolder()
  : path_(boost::filesystem::temp_directory_path() /
          boost::filesystem::unique_path("bundle_icp_test_%%%%%%%%%%%%"))
  {
    boost::filesystem::create_directories(path_);
  }

  ~TemporaryFolder()
  {
    boost::system::error_code ignored;
    boost::filesystem::remove_all(path_, ignored);
  }

  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder&
  operator=(const TemporaryFolder&) = delete;

  /** Path of the folder, or of something in it. */
  std::string
  path(const std::string& name = "") const
  {
    return name.empty() ? path_.string() : (path_ / name).string();
  }

private:
  boost::filesystem::path path_;
};

/** Writes a text file, with the folders above it. */
inline void
writeText(const std::string& path, const std::string& text)
{
  boost::filesystem::create_directories(boost::filesystem::path(path).parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

/** All bytes of a file; empty when there is none. */
inline std::string
readText(const std::string& path)
{
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}
