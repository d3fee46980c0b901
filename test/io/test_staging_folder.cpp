// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/staging_folder.h"

#include "messages.h"
#include "temporary_folder.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <dlfcn.h>
#include <map>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

// A result takes the place of an earlier one while each system call in turn fails, or ends the
// process. The calls are this program's own versions of those of the C library.

using namespace bundle_icp;
namespace fs = boost::filesystem;

namespace {

enum class Fault { NONE, ERROR, KILL };
Fault fault = Fault::NONE;
int calls_left = 0; ///< until the fault

/** Whether this call fails. */
bool
isFaulty()
{
  if (fault == Fault::NONE || calls_left-- != 0)
    return false;
  if (fault == Fault::KILL)
    std::raise(SIGKILL);
  errno = EIO;
  return true;
}

template <typename Function>
Function*
original(const char* name)
{
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

} // namespace

#ifndef __SANITIZE_ADDRESS__ // which has versions of its own
extern "C" {

int
rename(const char* from, const char* to) noexcept
{
  return isFaulty() ? -1 : original<int(const char*, const char*)>("rename")(from, to);
}

int
link(const char* from, const char* to) noexcept
{
  return isFaulty() ? -1 : original<int(const char*, const char*)>("link")(from, to);
}

int
fsync(int file)
{
  return isFaulty() ? -1 : original<int(int)>("fsync")(file);
}

ssize_t
write(int file, const void* data, std::size_t size)
{
  return isFaulty() ? -1
                    : original<ssize_t(int, const void*, std::size_t)>("write")(file, data, size);
}

ssize_t
writev(int file, const iovec* parts, int count)
{
  return isFaulty() ? -1 : original<ssize_t(int, const iovec*, int)>("writev")(file, parts, count);
}

std::FILE*
fopen64(const char* path, const char* mode)
{
  return isFaulty() ? nullptr
                    : original<std::FILE*(const char*, const char*)>("fopen64")(path, mode);
}

} // extern "C"
#endif

namespace {

const std::vector<std::string> KNOWN = {"both.txt", "linked.txt", "earlier.txt", "new.txt",
                                        "report.json"};
using Files = std::map<std::string, std::string>;

const Files EARLIER = {{"both.txt", "1"},
                       {"linked.txt", "1"},
                       {"earlier.txt", "1"},
                       {"report.json", "1"},
                       {"notes.txt", "by hand"}};
const Files NEW = {{"both.txt", "2"},
                   {"linked.txt", "2"},
                   {"new.txt", "2"},
                   {"report.json", "2"},
                   {"notes.txt", "by hand"}};

/** An earlier result, one file of which is a link to another folder. */
void
makeEarlier(const TemporaryFolder& folder)
{
  fs::create_directories(folder.path("out"));
  fs::create_directories(folder.path("elsewhere"));
  writeText(folder.path("elsewhere/linked.txt"), "");
  fs::create_symlink(folder.path("elsewhere/linked.txt"), folder.path("out/linked.txt"));
  for (const auto& [name, text] : EARLIER)
    writeText(folder.path("out/") + name, text);
}

void
publishNew(const std::string& folder)
{
  const StagingFolder staging(folder);
  for (const auto& [name, text] : NEW)
    if (name != "notes.txt" &&
        !(std::ofstream(staging.prefix() + name) << text << std::flush).good())
      throw pcl::IOException(name + ": cannot be written");
  staging.publish(KNOWN);
}

/** All files, hidden ones included. */
Files
filesOf(const std::string& folder)
{
  Files files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    files[entry.path().filename().string()] =
        fs::is_directory(entry.path()) ? "a folder" : readText(entry.path().string());
  return files;
}

/** Publishes in a process of its own, with a fault at a call.
 *  \return its status as of waitpid() */
int
publishWithFault(const std::string& folder, Fault kind, int call)
{
  const pid_t child = fork();
  if (child == 0) {
    fault = kind;
    calls_left = call;
    try {
      publishNew(folder);
    }
    catch (const pcl::IOException&) {
      _exit(1);
    }
    _exit(calls_left < 0 ? 2 : 0); // 2: the fault came, and did no harm
  }
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

} // namespace

TEST(StagingFolder, ReplacesAnEarlierResult)
{
  const TemporaryFolder folder;
  makeEarlier(folder);
  publishNew(folder.path("out"));
  EXPECT_EQ(filesOf(folder.path("out")), NEW);
  EXPECT_TRUE(fs::is_symlink(folder.path("out/linked.txt")));
  EXPECT_EQ(filesOf(folder.path("elsewhere")), (Files{{"linked.txt", "2"}}));
}

TEST(StagingFolder, AFaultOfAnyCallLeavesTheFolderWhollyOldOrNew)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer has its own versions of the calls";
#endif
  int faults = 0, call = 0;
  for (int status = 1; status != 0; ++call) {
    SCOPED_TRACE(call);
    const TemporaryFolder folder;
    makeEarlier(folder);
    status = publishWithFault(folder.path("out"), Fault::ERROR, call);
    ASSERT_TRUE(WIFEXITED(status));
    faults += WEXITSTATUS(status) == 1;
    EXPECT_EQ(filesOf(folder.path("out")), WEXITSTATUS(status) == 1 ? EARLIER : NEW);
    EXPECT_EQ(filesOf(folder.path("elsewhere")).size(), 1u);
    ASSERT_LT(call, 1000);
  }
  EXPECT_GT(faults, 20);
}

TEST(StagingFolder, AKillAtAnyCallIsMendedByTheNextRun)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer has its own versions of the calls";
#endif
  int old = 0, mended = 0, call = 0;
  for (int status = 1; status != 0; ++call) {
    SCOPED_TRACE(call);
    const TemporaryFolder folder;
    makeEarlier(folder);
    status = publishWithFault(folder.path("out"), Fault::KILL, call);
    finishPublishing(folder.path("out"));
    const Files files = filesOf(folder.path("out"));
    EXPECT_TRUE(files == EARLIER || files == NEW) << testing::PrintToString(files);
    EXPECT_EQ(files == NEW, filesOf(folder.path("elsewhere"))["linked.txt"] == "2");
    old += files == EARLIER;
    mended += WIFSIGNALED(status) && files == NEW;
    ASSERT_LT(call, 1000);
  }
  EXPECT_GT(old, 10);
  EXPECT_GT(mended, 5);
}

TEST(StagingFolder, LeavesTheFolderOfALivingRun)
{
  const TemporaryFolder folder;
  const StagingFolder alive(folder.path("out"));
  writeText(alive.prefix() + "new.txt", "2");
  finishPublishing(folder.path("out"));
  EXPECT_EQ(readText(alive.prefix() + "new.txt"), "2");
}

TEST(StagingFolder, LooksAtAllTargetsFirst)
{
  for (const bool is_pipe : {false, true}) {
    const TemporaryFolder folder;
    makeEarlier(folder);
    if (is_pipe)
      mkfifo(folder.path("out/new.txt").c_str(), 0600);
    else
      fs::create_directory(folder.path("out/new.txt"));
    const std::string message =
        messageOf<pcl::IOException>([&] { checkTargets(folder.path("out"), KNOWN); });
    EXPECT_CONTAINS(message, folder.path("out/new.txt"));
    EXPECT_CONTAINS(message, is_pipe ? "not a regular file" : "it is a folder");
    EXPECT_THROW(publishNew(folder.path("out")), pcl::IOException);
    EXPECT_EQ(readText(folder.path("out/both.txt")), "1");
    EXPECT_EQ(readText(folder.path("out/report.json")), "1");
  }
}

TEST(StagingFolder, MakesFoldersHoweverTheyAreNamed)
{
  const TemporaryFolder folder;
  for (const char* name : {"a", "b/", "c/.", "d/e/..", "./f/./g/"}) {
    makeFolder(folder.path(name));
    EXPECT_TRUE(fs::is_directory(folder.path(name))) << name;
  }
  writeText(folder.path("file"), "");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { makeFolder(folder.path("file/x")); }),
                  folder.path("file/x") + ": cannot be made a folder");
}
