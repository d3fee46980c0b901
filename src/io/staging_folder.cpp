// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/staging_folder.h"

#include "io/file_system.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/io/atomic_file.h>

#include <boost/filesystem.hpp>

#include <fcntl.h>
#include <fstream>
#include <sys/file.h>
#include <unistd.h>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

const char* const HIDDEN_PREFIX = ".bundle_icp_";
const char* const JOURNAL = "journal";

/** A file takes its place, or one of an earlier result loses its own. */
struct Step {
  fs::path staged; ///< empty = `target` is removed
  fs::path target;
  std::string path; ///< of the target as the user knows it
};

/** Where the earlier file is kept until all steps are done: on the file system of the target. */
fs::path
backupOf(const Step& step, const fs::path& staging)
{
  return step.staged.empty() ? staging / (step.target.filename().string() + ".earlier")
                             : fs::path(step.staged.string() + ".earlier");
}

/** The steps of publishing, in their order. Files whose targets lie on another file system are
 *  copied beside them: nothing can be renamed across. */
void
planSteps(const fs::path& folder, const fs::path& staging, const std::vector<std::string>& known,
          std::vector<Step>& steps)
{
  boost::system::error_code code;
  const fs::path place = fs::canonical(folder); // "." and links name no other file system
  for (const std::string& name : known) {
    const std::string path = (folder / name).string();
    if (fs::exists(staging / name)) {
      const Step step{staging / name, writeTarget((place / name).string()), path};
      synchronise(step.staged, path);
      if (step.target.parent_path() != place) {
        const fs::path copy = createBeside(step.target, path);
        steps.push_back({copy, step.target, path});
        fs::copy_file(step.staged, copy, fs::copy_options::overwrite_existing, code);
        if (code)
          failWriting(path, code.message());
        synchronise(copy, path);
      }
      else
        steps.push_back(step);
    }
    else if (const fs::file_type type = fs::symlink_status(path, code).type();
             type == fs::regular_file || type == fs::symlink_file)
      steps.push_back({{}, place / name, path});
  }
}

/** A second name for the earlier file, or another place where the file system has no such names. */
void
keepEarlier(const Step& step, const fs::path& backup)
{
  if (::link(step.target.c_str(), backup.c_str()) != 0)
    rename(step.target, backup, step.path);
}

/** \return whether there was an earlier file. */
bool
take(const Step& step, const fs::path& staging)
{
  const fs::path backup = backupOf(step, staging);
  const bool has_earlier = fs::exists(fs::symlink_status(step.target));
  if (step.staged.empty()) {
    rename(step.target, backup, step.path);
    return true;
  }
  if (has_earlier)
    keepEarlier(step, backup);
  try {
    rename(step.staged, step.target, step.path);
  }
  catch (const pcl::IOException&) {
    if (has_earlier && !fs::exists(step.target))
      std::rename(backup.c_str(), step.target.c_str());
    throw;
  }
  return has_earlier;
}

/** Puts the earlier file back. All that can be done is done: there is an error already. */
void
giveBack(const Step& step, bool had_earlier, const fs::path& staging)
{
  boost::system::error_code ignored;
  if (had_earlier)
    fs::rename(backupOf(step, staging), step.target, ignored);
  else
    fs::remove(step.target, ignored);
}

/** Removes what lies outside the hidden folder. */
void
removeLeftovers(const std::vector<Step>& steps, const fs::path& staging)
{
  boost::system::error_code ignored;
  for (const Step& step : steps)
    if (!step.staged.empty() && step.staged.parent_path() != staging) {
      fs::remove(step.staged, ignored);
      fs::remove(backupOf(step, staging), ignored);
    }
}

/** Paths end with 0, which no path contains. */
void
writeJournal(const std::vector<Step>& steps, const fs::path& staging, const std::string& folder)
{
  writeAtomically((staging / JOURNAL).string(), [&](const std::string& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    for (const Step& step : steps)
      file << step.staged.string() << '\0' << step.target.string() << '\0';
    if (!file.flush())
      failWriting(folder, "is the disk full?");
  });
}

std::vector<Step>
readJournal(const fs::path& staging)
{
  std::vector<std::string> paths(1);
  for (const char c : readBytes((staging / JOURNAL).string()))
    if (c == '\0')
      paths.emplace_back();
    else
      paths.back() += c;
  std::vector<Step> steps;
  for (std::size_t i = 0; i + 1 < paths.size(); i += 2)
    steps.push_back({paths[i], paths[i + 1], paths[i + 1]});
  return steps;
}

/** Does the steps that a killed run left. */
void
finishSteps(const std::vector<Step>& steps)
{
  for (const Step& step : steps)
    if (!step.staged.empty() && fs::exists(step.staged))
      rename(step.staged, step.target, step.path);
    else if (boost::system::error_code ignored; step.staged.empty())
      fs::remove(step.target, ignored);
}

/** Opens and locks a hidden folder.
 *  \return its descriptor; -1 when another process holds it, or its file system knows no locks. */
int
lockFolder(const fs::path& folder)
{
  const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file >= 0 && ::flock(file, LOCK_EX | LOCK_NB) != 0) {
    ::close(file);
    return -1;
  }
  return file;
}

} // namespace

void
makeFolder(const std::string& folder)
{
  boost::system::error_code error;
  fs::path path;
  // Part by part: "." and ".." are no folders that can be made.
  for (const fs::path& part : fs::path(folder)) {
    path /= part;
    if (part == "." || part == ".." || error || fs::is_directory(path))
      continue;
    if (fs::exists(path))
      error = make_error_code(boost::system::errc::not_a_directory);
    else
      fs::create_directory(path, error);
  }
  if (!fs::is_directory(folder))
    throw IOException(folder + ": cannot be made a folder" + (error ? ": " + error.message() : ""));
}

void
finishPublishing(const std::string& folder)
{
  std::vector<fs::path> left;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.path().filename().string().rfind(HIDDEN_PREFIX, 0) == 0 &&
        fs::is_directory(entry.symlink_status()))
      left.push_back(entry.path());
  for (const fs::path& staging : left) {
    const int lock = lockFolder(staging);
    if (lock < 0)
      continue;
    if (fs::exists(staging / JOURNAL)) {
      const std::vector<Step> steps = readJournal(staging);
      finishSteps(steps);
      removeLeftovers(steps, staging);
    }
    boost::system::error_code ignored;
    fs::remove_all(staging, ignored);
    ::close(lock);
  }
}

void
checkTargets(const std::string& folder, const std::vector<std::string>& names)
{
  for (const std::string& name : names)
    writeTarget((fs::path(folder) / name).string());
}

StagingFolder::StagingFolder(const std::string& folder) : folder_(folder)
{
  makeFolder(folder);
  finishPublishing(folder);
  const fs::path path =
      fs::canonical(folder) / fs::unique_path(std::string(HIDDEN_PREFIX) + "%%%%%%%%");
  boost::system::error_code error;
  if (!fs::create_directory(path, error))
    failWriting(folder, error.message());
  path_ = path.string();
  lock_ = lockFolder(path);
}

StagingFolder::~StagingFolder()
{
  boost::system::error_code ignored;
  fs::remove_all(path_, ignored);
  if (lock_ >= 0)
    ::close(lock_);
}

void
StagingFolder::publish(const std::vector<std::string>& known) const
{
  const fs::path staging = path_;
  std::vector<Step> steps;
  std::vector<bool> had_earlier;
  try {
    planSteps(folder_, staging, known, steps);
    writeJournal(steps, staging, folder_);
    for (const Step& step : steps)
      had_earlier.push_back(take(step, staging));
    synchronise(folder_, folder_);
  }
  catch (...) {
    for (std::size_t i = had_earlier.size(); i-- > 0;)
      giveBack(steps[i], had_earlier[i], staging);
    boost::system::error_code ignored;
    fs::remove(staging / JOURNAL, ignored);
    removeLeftovers(steps, staging);
    throw;
  }
  // Without its journal the hidden folder is a leftover, whenever the run is killed.
  boost::system::error_code ignored;
  fs::remove(staging / JOURNAL, ignored);
  removeLeftovers(steps, staging);
}

} // namespace bundle_icp
