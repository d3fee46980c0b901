// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/atomic_file.h>

#include "io/file_system.h"

#include <boost/filesystem.hpp>

namespace bundle_icp {

namespace fs = boost::filesystem;

void
writeAtomically(const std::string& path,
                const std::function<void(const std::string& temporary_path)>& write)
{
  const fs::path target = writeTarget(path);
  const fs::path temporary = createBeside(target, path);
  try {
    write(temporary.string());
    synchronise(temporary, path);
    rename(temporary, target, path);
  }
  catch (...) {
    boost::system::error_code ignored;
    fs::remove(temporary, ignored);
    throw;
  }
  synchronise(target.parent_path(), path);
}

} // namespace bundle_icp
