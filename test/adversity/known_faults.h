// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <map>
#include <string>

namespace adversity {

/** Inputs whose silent fault, or whose cause that is not named, is known, and why it stays. The
 *  suite fails as well when one of them is a fault no longer. */
inline const std::map<std::string, std::string>&
knownFaults()
{
  static const std::map<std::string, std::string> faults = {
      {"30_cm_too_far.table", "doubtful, but by its symptoms alone"},
      {"as_seven_scenes_with_poses.table", "1.4 mm for 1.2; the camera is that of the format"},
      {"dark_start.desk", "frames without colour are placed by depth alone: 13 mm for 12"},
      {"depth_20_px_right.table", "usable, 1.2 mm for 1.2, with a warning that names the cause"},
      {"depth_half_a_frame_later.half_late", "1.5 mm for 1.2: half a frame moves few edges"},
  };
  return faults;
}

} // namespace adversity
