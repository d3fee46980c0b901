// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/atomic_file.h>

#include <boost/filesystem.hpp>
#include <pcl/exceptions.h>

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

[[noreturn]] void
fail(const std::string& path, const std::string& reason)
{
  throw pcl::IOException(path + ": cannot be written: " + reason);
}

// What a link points to is replaced, not the link; nothing but a file is ever replaced.
fs::path
resolve(const std::string& path)
{
  boost::system::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (fs::is_directory(status))
    fail(path, "it is a folder");
  if (fs::exists(status) && !fs::is_regular_file(status))
    fail(path, "it is not a regular file");
  return fs::exists(status) ? fs::canonical(path) : fs::absolute(path);
}

// Creating the file here rather than in the writer tells why a folder cannot be written
// to.
fs::path
createBeside(const fs::path& target, const std::string& path)
{
  const std::string name =
      "." + target.stem().string() + ".%%%%-%%%%-%%%%" + target.extension().string();
  const fs::path temporary = target.parent_path() / fs::unique_path(name);
  const int file = ::open(temporary.c_str(), O_CREAT | O_EXCL | O_WRONLY, 0666);
  if (file < 0)
    fail(path, std::strerror(errno));
  ::close(file);
  return temporary;
}

void
synchronise(const fs::path& file_or_folder, const std::string& path)
{
  const int file = ::open(file_or_folder.c_str(), O_RDONLY);
  if (file < 0)
    fail(path, std::strerror(errno));
  const int result = ::fsync(file);
  const int error = errno;
  ::close(file);
  // File systems that cannot synchronise (some network and FUSE ones) say EINVAL.
  if (result != 0 && error != EINVAL)
    fail(path, std::strerror(error));
}

} // namespace

void
writeAtomically(const std::string& path,
                const std::function<void(const std::string& temporary_path)>& write)
{
  const fs::path target = resolve(path);
  const fs::path temporary = createBeside(target, path);
  try {
    write(temporary.string());
    synchronise(temporary, path);
    if (std::rename(temporary.c_str(), target.c_str()) != 0)
      fail(path, std::strerror(errno));
  }
  catch (...) {
    boost::system::error_code ignored;
    fs::remove(temporary, ignored);
    throw;
  }
  synchronise(target.parent_path(), path);
}

} // namespace bundle_icp
