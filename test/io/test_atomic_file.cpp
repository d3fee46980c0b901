// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/atomic_file.h>

#include "messages.h"
#include "temporary_folder.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <unistd.h>

using namespace bundle_icp;
namespace fs = boost::filesystem;

namespace {

std::size_t
numFiles(const std::string& folder)
{
  return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
}

} // namespace

TEST(WriteAtomically, ReplacesAFileAndLeavesNothingElse)
{
  const TemporaryFolder folder;
  const std::string path = folder.path("mesh.ply");
  writeText(path, "old");
  std::string temporary;
  writeAtomically(path, [&](const std::string& name) {
    temporary = name;
    writeText(name, "new");
    EXPECT_EQ(readText(path), "old"); // until the writer is done
  });
  EXPECT_EQ(fs::path(temporary).extension(), ".ply"); // writers choose formats by it
  EXPECT_EQ(fs::path(temporary).parent_path(), fs::path(folder.path()));
  EXPECT_EQ(readText(path), "new");
  EXPECT_EQ(numFiles(folder.path()), 1u);
}

TEST(WriteAtomically, FailingWriterLeavesTheOldFile)
{
  const TemporaryFolder folder;
  const std::string path = folder.path("mesh.ply");
  writeText(path, "old");
  const auto write = [](const std::string& name) {
    writeText(name, "half");
    throw std::runtime_error("the writer's reason");
  };
  EXPECT_EQ(messageOf<std::runtime_error>([&] { writeAtomically(path, write); }),
            "the writer's reason");
  EXPECT_EQ(readText(path), "old");
  EXPECT_EQ(numFiles(folder.path()), 1u);
}

TEST(WriteAtomically, FollowsLinks)
{
  const TemporaryFolder folder;
  writeText(folder.path("there/file.txt"), "old");
  fs::create_symlink(folder.path("there/file.txt"), folder.path("link.txt"));
  writeAtomically(folder.path("link.txt"), [](const std::string& name) { writeText(name, "new"); });
  EXPECT_TRUE(fs::is_symlink(folder.path("link.txt")));
  EXPECT_EQ(readText(folder.path("there/file.txt")), "new");
}

TEST(WriteAtomically, RefusesPlacesThatCannotBeWritten)
{
  const TemporaryFolder folder;
  bool was_called = false;
  const auto error = [&](const std::string& path) {
    return messageOf<pcl::IOException>(
        [&] { writeAtomically(path, [&](const std::string&) { was_called = true; }); });
  };
  EXPECT_CONTAINS(error(folder.path("absent/file.txt")),
                  "absent/file.txt: cannot be written: No such file or directory");
  EXPECT_CONTAINS(error(folder.path()), "it is a folder");
  EXPECT_CONTAINS(error("/dev/full"), "/dev/full: cannot be written: it is not a regular file");
  if (::geteuid() != 0) { // nothing is unwritable to root
    fs::permissions(folder.path(), fs::owner_read | fs::owner_exe);
    EXPECT_CONTAINS(error(folder.path("file.txt")), "Permission denied");
    fs::permissions(folder.path(), fs::owner_all);
  }
  EXPECT_FALSE(was_called);
}

TEST(WriteAtomically, WorksInTheCurrentFolder)
{
  const TemporaryFolder folder;
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  writeAtomically("file", [](const std::string& name) { writeText(name, "new"); });
  fs::current_path(before);
  EXPECT_EQ(readText(folder.path("file")), "new");
}
