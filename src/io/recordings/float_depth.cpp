// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/float_depth.h"

#include "io/image_file.h"

#include <boost/algorithm/string/case_conv.hpp>
#include <boost/filesystem.hpp>

namespace bundle_icp {

namespace {

/** Only these kinds of files can hold floats. */
bool
mayHoldFloats(const std::string& file)
{
  const std::string extension =
      boost::to_lower_copy(boost::filesystem::path(file).extension().string());
  return extension == ".tif" || extension == ".tiff" || extension == ".exr";
}

} // namespace

void
useMetresOfFloats(Recording& recording)
{
  for (const RecordedFrame& frame : recording.frames) {
    if (recording.reader || !mayHoldFloats(frame.depth_file))
      return;
    try {
      if (readDepthImage(frame.depth_file).depth() == CV_32F) {
        recording.depth_scale = 1;
        recording.depth_scale_source = "the depth images, which hold floats: metres";
      }
      return;
    }
    catch (const pcl::IOException&) {
      // The next one may be readable.
    }
  }
}

} // namespace bundle_icp
