// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <map>
#include <string>

namespace adversity {

/** Inputs with a silent fault that is known, and why it stays. The suite fails as well when one of
 *  them is a fault no longer. */
inline const std::map<std::string, std::string>&
knownFaults()
{
  static const std::map<std::string, std::string> faults = {
      {"dark_start.desk", "frames without colour are placed by depth alone: 13 mm for 12"},
      {"depth_half_a_frame_later.half_late", "1.5 mm for 1.2: half a frame moves few edges"},
      {"focal_length_30_percent_long.walls", "walls alone tell focal length and centre not apart"},
      {"frames_of_another_recording.table", "frames of another room are placed by geometry"},
      {"one_list_some_wrong_pairs.desk", "a quarter of wrong pairs is too few for the check"},
      {"some_depth_of_another_recording.table", "three frames are too few for the check"},
  };
  return faults;
}

} // namespace adversity
