// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/free_memory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <string>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace bundle_icp {
namespace {

/** The kernel's own estimate, with what it can take from its caches. */
std::optional<std::size_t>
availableMemory()
{
  std::ifstream file("/proc/meminfo");
  std::size_t kilobytes = 0;
  for (std::string name; file >> name; std::getline(file, name))
    if (name == "MemAvailable:" && file >> kilobytes)
      return 1024 * kilobytes;
  return std::nullopt;
}

/** The first number of a file; unset when there is none, as in one that says "max". */
std::optional<std::size_t>
readNumber(const char* path)
{
  std::size_t number = 0;
  if (std::ifstream(path) >> number)
    return number;
  return std::nullopt;
}

} // namespace

std::size_t
freeMemory()
{
  const std::optional<std::size_t> available = availableMemory();
  std::size_t bytes =
      available ? *available
                : std::size_t(sysconf(_SC_AVPHYS_PAGES)) * std::size_t(sysconf(_SC_PAGESIZE));
  const auto limit = readNumber("/sys/fs/cgroup/memory.max"),
             used = readNumber("/sys/fs/cgroup/memory.current");
  if (limit && used)
    bytes = std::min(bytes, *limit - std::min(*limit, *used));
  return bytes;
}

void
returnMemory()
{
#if defined(__GLIBC__)
  malloc_trim(0);
#endif
}

} // namespace bundle_icp
