// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <string>
#include <vector>

namespace bundle_icp {

/** A hidden folder in a folder of results, where files are written before they take their places
 *  together. Removed at the end, with what is left in it. */
class StagingFolder {
public:
  /** Makes both folders where needed, after finishPublishing().
   *  \throws pcl::IOException naming the folder and the reason. */
  explicit StagingFolder(const std::string& folder);
  ~StagingFolder();
  StagingFolder(const StagingFolder&) = delete;
  StagingFolder&
  operator=(const StagingFolder&) = delete;

  /** Path of the hidden folder, with a slash at its end. */
  std::string
  prefix() const
  {
    return path_ + "/";
  }

  /** Gives every file its place. Files of an earlier result that this one does not have are
   *  removed: they would pass for a part of this one. When a step fails, the earlier files are put
   *  back. A run that is killed meanwhile leaves a journal, by which finishPublishing() ends the
   *  work.
   *  \param known names of all files that a result can have, in the order in which they are placed
   *  \throws pcl::IOException naming the file and the reason; the folder is then as it was. */
  void
  publish(const std::vector<std::string>& known) const;

private:
  std::string folder_, path_;
  int lock_ = -1; ///< tells other runs that this one lives
};

/** Makes a folder with the folders above it, where needed.
 *  \throws pcl::IOException naming the folder and the reason. */
void
makeFolder(const std::string& folder);

/** Ends what killed runs began: files that had begun to take their places all take them, and hidden
 *  folders are removed. Those of runs that are still alive stay.
 *  \throws pcl::IOException naming the file and the reason. */
void
finishPublishing(const std::string& folder);

/** Checks that files of these names can take their places: none is a folder, a device or the like.
 *  \throws pcl::IOException naming the file and the reason. */
void
checkTargets(const std::string& folder, const std::vector<std::string>& names);

} // namespace bundle_icp
