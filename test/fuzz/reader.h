// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <boost/filesystem.hpp>
#include <pcl/console/print.h>
#include <pcl/exceptions.h>

#include <cstdint>
#include <fstream>
#include <string>
#include <unistd.h>

namespace fuzz {

/** A folder of this process in memory, removed at its end. */
inline const std::string&
folder()
{
  static const struct Folder {
    std::string path = "/dev/shm/bundle_icp_fuzz_" + std::to_string(getpid());
    Folder() { boost::filesystem::create_directories(path); }
    ~Folder() { boost::filesystem::remove_all(path); }
  } folder;
  return folder.path;
}

inline void
write(const std::string& path, const std::string& bytes)
{
  std::ofstream(path, std::ios::binary) << bytes;
}

/** A reader may refuse a file, in the way that its header says, and do nothing else. */
template <typename Read>
void
read(const Read& reader)
{
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  try {
    reader();
  }
  catch (const pcl::IOException&) {
  }
  catch (const pcl::BadArgumentException&) {
  }
}

} // namespace fuzz
