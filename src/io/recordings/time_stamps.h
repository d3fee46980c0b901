// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** A unit of time stamps. */
struct TimeUnit {
  double seconds = 1;
  const char* name = "seconds";
};

/** Whether a number is a plausible time since 1970. */
bool
isUnixTime(double seconds);

/** The unit that numbers tell if they are times: by their size when they count from 1970, else by
 *  the step from one to the next, which is 10 ms to 2 s for a camera.
 *  \return nothing when the numbers may as well be numbers of frames. */
std::optional<TimeUnit>
timeUnitOf(const std::vector<double>& numbers);

/** Whether the stamps of a list, in its order, tell when images were taken.
 *  \param names_rise the names of the images count up in the order of the list, apart from stamps
 *  \return empty when they do, else what is wrong with them */
std::string
faultOfStamps(const std::vector<double>& stamps, bool names_rise);

} // namespace bundle_icp
