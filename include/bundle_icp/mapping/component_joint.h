// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstddef>

namespace bundle_icp {

/** Two parts of a scan that share too few features and were joined by their shape, and what the
 *  joint rests on. A part is a component, or a frame that was in none. */
struct ComponentJoint {
  std::size_t first_frames = 0;  ///< frames of the part whose world stayed, at that time
  std::size_t second_frames = 0; ///< frames of the part that was moved into it
  /** Frames of the second part that Bundle ICP, with depth alone, placed within 5 cm and 3 degrees
   *  of the joint. */
  std::size_t held_frames = 0;
  /** Largest share of a frame's depth, among the second part's, that agrees with the depth of one
   *  frame of the first part, 0 to 1. */
  double overlap = 0;
  /** Share of the depth that agrees with what the other part saw, of that which agrees or lies in
   *  front of it, in either direction. */
  double agreement = 0;
  /** Matches of features that agree with the joint, of the two frames with most. 0: shape alone. */
  std::size_t matches = 0;
  /** What the depth says for the joint, and for the best of all other motions: depth shared by the
   *  frames of the second part, in images, times the squared agreement. */
  double support = 0, runner_up_support = 0;
};

} // namespace bundle_icp
