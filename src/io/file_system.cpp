// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/file_system.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

namespace bundle_icp {

namespace fs = boost::filesystem;

void
failWriting(const std::string& path, const std::string& reason)
{
  throw IOException(path + ": cannot be written: " + reason);
}

fs::path
writeTarget(const std::string& path)
{
  boost::system::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (fs::is_directory(status))
    failWriting(path, "it is a folder");
  if (fs::exists(status) && !fs::is_regular_file(status))
    failWriting(path, "it is not a regular file");
  if (status.type() == fs::status_error)
    failWriting(path, code.message());
  return fs::exists(status) ? fs::canonical(path) : fs::absolute(path);
}

// Creating the file here rather than in the writer tells why a folder cannot be written to.
fs::path
createBeside(const fs::path& target, const std::string& path)
{
  const std::string name =
      "." + target.stem().string() + ".%%%%-%%%%-%%%%" + target.extension().string();
  const fs::path temporary = target.parent_path() / fs::unique_path(name);
  const int file = ::open(temporary.c_str(), O_CREAT | O_EXCL | O_WRONLY, 0666);
  if (file < 0)
    failWriting(path, std::strerror(errno));
  ::close(file);
  return temporary;
}

void
synchronise(const fs::path& file_or_folder, const std::string& path)
{
  const int file = ::open(file_or_folder.c_str(), O_RDONLY);
  if (file < 0)
    failWriting(path, std::strerror(errno));
  const int result = ::fsync(file);
  const int error = errno;
  ::close(file);
  // File systems that cannot synchronise (some network and FUSE ones) say EINVAL.
  if (result != 0 && error != EINVAL)
    failWriting(path, std::strerror(error));
}

void
rename(const fs::path& from, const fs::path& to, const std::string& path)
{
  if (std::rename(from.c_str(), to.c_str()) != 0)
    failWriting(path, std::strerror(errno));
}

} // namespace bundle_icp
