// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/unused_files.h"

#include <boost/algorithm/string/case_conv.hpp>
#include <boost/filesystem.hpp>

#include <algorithm>
#include <set>

namespace bundle_icp {
namespace {

namespace fs = boost::filesystem;

/** Deeper folders are no part of any layout. */
constexpr int MAX_DEPTH = 2;

/** By its extension: an image, or a recording of another kind. */
bool
holdsFrames(const fs::path& file)
{
  static const std::set<std::string> extensions{".png", ".jpg", ".jpeg", ".pgm",  ".ppm", ".pnm",
                                                ".bmp", ".tif", ".tiff", ".exr",  ".pcd", ".bag",
                                                ".db3", ".oni", ".mkv",  ".mcap", ".klg", ".sens"};
  return extensions.count(boost::algorithm::to_lower_copy(file.extension().string())) > 0;
}

std::string
normal(const fs::path& file)
{
  return fs::absolute(file).lexically_normal().string();
}

} // namespace

std::vector<Finding>
unusedFiles(const Recording& recording, const std::string& folder)
{
  std::set<std::string> used;
  for (const RecordedFrame& frame : recording.frames)
    used.insert({normal(frame.color_file), normal(frame.depth_file), normal(frame.mask_file)});
  for (const std::string& file : recording.other_files)
    used.insert(normal(file));
  for (const SkippedFile& skipped : recording.skipped)
    used.insert(normal(skipped.file)); // named with its reason elsewhere
  std::vector<std::string> unused;
  boost::system::error_code ignored; // a folder that cannot be read holds nothing of the recording
  for (fs::recursive_directory_iterator file(folder, ignored), end; file != end;
       file.increment(ignored)) {
    if (file.depth() == MAX_DEPTH)
      file.disable_recursion_pending();
    if (fs::is_regular_file(file->path(), ignored) && holdsFrames(file->path()) &&
        !used.count(normal(file->path())))
      unused.push_back(fs::relative(file->path(), folder, ignored).string());
  }
  if (unused.empty())
    return {};
  const std::string& first = *std::min_element(unused.begin(), unused.end());
  return {{Severity::NOTE,
           "unused_files",
           std::to_string(unused.size()) +
               " images or recordings in the folder belong to no "
               "frame, such as " +
               first,
           {{"files", double(unused.size())}},
           ""}};
}

} // namespace bundle_icp
