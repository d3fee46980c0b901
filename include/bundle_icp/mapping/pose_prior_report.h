// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstddef>

namespace bundle_icp {

/** What prior poses were worth: their motions between key frames that follow each other in time,
 *  compared with those that images and depth say. Of the component with most of such motions. */
struct PosePriorReport {
  std::size_t frames = 0;   ///< frames of the graph with a prior
  std::size_t motions = 0;  ///< motions that were compared; 0 = the prior was not used
  std::size_t left_out = 0; ///< of these, motions that contradict the data
  /** Standard deviations of a step from frame to frame, along each axis [m], about each [rad]: as
   *  said, and as the data show them. */
  double said_position = 0, said_rotation = 0;
  double measured_position = 0, measured_rotation = 0;
  /** False: errors of this part are as large as the motion itself, and it was not used. */
  bool uses_position = false, uses_rotation = false;
};

} // namespace bundle_icp
