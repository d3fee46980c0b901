// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <boost/filesystem/path.hpp>

#include <string>

/** Steps of writing that say what went wrong. All throw pcl::IOException with the path that the
 *  user knows and the reason. */
namespace bundle_icp {

[[noreturn]] void
failWriting(const std::string& path, const std::string& reason);

/** Path of the file that writing replaces: what a link points to, not the link.
 *  \throws when it is something else than a file. */
boost::filesystem::path
writeTarget(const std::string& path);

/** A new empty hidden file in the folder of `target`, with its extension. */
boost::filesystem::path
createBeside(const boost::filesystem::path& target, const std::string& path);

/** Waits until a file or the entries of a folder are on the disk. */
void
synchronise(const boost::filesystem::path& file_or_folder, const std::string& path);

/** Replaces `to`. Both lie on one file system. */
void
rename(const boost::filesystem::path& from, const boost::filesystem::path& to,
       const std::string& path);

} // namespace bundle_icp
