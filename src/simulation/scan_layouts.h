// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/simulation/synthetic_scan.h>

#include <boost/filesystem/path.hpp>

#include <string>
#include <vector>

namespace bundle_icp {

/** A frame as it is written. */
struct WrittenFrame {
  std::size_t index = 0;
  cv::Mat color;       ///< CV_8UC3
  cv::Mat depth_units; ///< CV_16UC1, 0 = not measured
};

/** What a format says of a depth camera; each can say what those before can. */
enum class DepthView {
  REGISTERED, ///< depth lies in the colour camera's pixels
  SAME,       ///< the view of colour, in another size
  SAME_PLACE, ///< another lens
  ANY         ///< another lens in another place
};

/** How a scan is written in the format of a recorder. */
struct ScanLayout {
  const char* name;
  DepthView depth_view;
  double units_per_metre;
  /** Names of the images of a frame, in the folder, with `{stamp}`, `{microseconds}`, `{number}`,
   *  or the number as `{0000}` or `{000000}`; empty = the images are no files. */
  const char *color_file, *depth_file;
  std::vector<const char*> other_folders; ///< besides those of the images
  /** Writes what else belongs to a frame; may be unset. Several threads call at once. */
  void (*write_frame)(const SyntheticScan&, const WrittenFrame&,
                      const boost::filesystem::path& folder);
  /** Writes lists, camera and poses, after all frames; may be unset. */
  void (*write_lists)(const SyntheticScan&, const boost::filesystem::path& folder);
};

/** What a format must be able to say of the depth camera of a scan. */
DepthView
depthViewOf(const SyntheticScan& scan);

/** All layouts; that of TUM RGB-D comes first. */
const std::vector<ScanLayout>&
scanLayouts();

/** The name of a file of frame `index` that color_file or depth_file stand for. */
std::string
nameOfFrame(const char* pattern, const SyntheticScan& scan, std::size_t index);

/** The layout of a name; null when there is none. */
const ScanLayout*
findScanLayout(const std::string& name);

} // namespace bundle_icp
