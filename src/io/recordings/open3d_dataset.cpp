// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/calibration_files.h"

#include "io/recordings/image_streams.h"
#include "io/recordings/name_numbers.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

fs::path
colorFolder(const fs::path& folder)
{
  for (const char* const name : {"color", "image", "rgb"})
    if (fs::is_directory(folder / name))
      return folder / name;
  return {};
}

// TUM's images without its lists: units and camera are then unknown.
void
refuseTumWithoutLists(const std::string& folder, const DatasetOptions& options,
                      const Recording& recording)
{
  const std::string stem = fs::path(recording.frames[0].color_file).stem().string();
  const bool is_tum = colorFolder(folder).filename() == "rgb" && isNumber(stem) &&
                      stem.find('.') != std::string::npos;
  if (is_tum && !options.depth_scale && !recording.intrinsics)
    throw IOException(folder + ": the depth images' unit is unknown: rgb/ and depth/ with "
                               "times as names are TUM RGB-D's, but its lists rgb.txt and "
                               "depth.txt are absent; give the unit with --depth-scale (TUM "
                               "5000)");
}

} // namespace

bool
isOpen3dFolder(const std::string& folder)
{
  return !colorFolder(folder).empty() && fs::is_directory(fs::path(folder) / "depth");
}

Recording
readOpen3dFolder(const std::string& folder, const DatasetOptions& options)
{
  Recording recording;
  recording.format = "Open3D";
  recording.depth_scale = 1000;
  recording.depth_scale_source = "the format (Open3D)";
  pairImages(listImages(colorFolder(folder).string()),
             listImages((fs::path(folder) / "depth").string()), options, folder, recording);
  readCalibrationFile(folder, recording);
  refuseTumWithoutLists(folder, options, recording);
  return recording;
}

} // namespace bundle_icp
