// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/time_stamps.h"

#include "io/text_file.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace bundle_icp {
namespace {

constexpr std::array<TimeUnit, 4> UNITS = {
    {{1, "seconds"}, {1e-3, "milliseconds"}, {1e-6, "microseconds"}, {1e-9, "nanoseconds"}}};

/** Share of the images that may have the stamp of another one. */
constexpr double MOST_REPEATED = 0.05;

/** Time from one image to the next below which stamps are no seconds [s]. */
constexpr double SHORTEST_STEP = 5e-4;

/** Differences of neighbours that are not 0, sorted. */
std::vector<double>
stepsBetween(std::vector<double> numbers)
{
  std::sort(numbers.begin(), numbers.end());
  std::vector<double> steps;
  for (std::size_t i = 1; i < numbers.size(); ++i)
    if (numbers[i] > numbers[i - 1])
      steps.push_back(numbers[i] - numbers[i - 1]);
  std::sort(steps.begin(), steps.end());
  return steps;
}

} // namespace

bool
isUnixTime(double seconds)
{
  return seconds > 9e8 && seconds < 5e9; // from 1998 to 2128
}

std::optional<TimeUnit>
timeUnitOf(const std::vector<double>& numbers)
{
  std::vector<double> sorted = numbers;
  std::sort(sorted.begin(), sorted.end());
  const double middle = sorted.empty() ? 0 : sorted[sorted.size() / 2];
  for (const TimeUnit& unit : UNITS)
    if (isUnixTime(middle * unit.seconds))
      return unit;

  const std::vector<double> steps = stepsBetween(numbers);
  if (steps.empty())
    return std::nullopt;
  const double step = steps[steps.size() / 2];
  const bool has_fractions =
      std::any_of(numbers.begin(), numbers.end(), [](double x) { return x != std::floor(x); });
  if (has_fractions && step < 10)
    return UNITS[0];
  // Numbers of frames may go up in steps of 10 or 100, but these are all alike.
  const bool is_even = steps.back() == steps.front();
  if (step < 10 || (is_even && step < 1e4))
    return std::nullopt;
  for (const TimeUnit& unit : UNITS)
    if (unit.seconds < 1 && step * unit.seconds >= 0.01 && step * unit.seconds <= 2)
      return unit;
  return std::nullopt;
}

std::string
faultOfStamps(const std::vector<double>& stamps, bool names_rise)
{
  std::vector<double> distinct = stamps;
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  const std::string number = std::to_string(stamps.size());
  if (stamps.size() > 1 && distinct.size() == 1)
    return "all " + number + " are equal";
  if (double(stamps.size() - distinct.size()) > MOST_REPEATED * double(stamps.size()))
    return "the " + number + " images share " + std::to_string(distinct.size()) + " stamps";
  if (const std::vector<double> steps = stepsBetween(stamps);
      !steps.empty() && steps[steps.size() / 2] < SHORTEST_STEP)
    return "they are " + shortText(1e3 * steps[steps.size() / 2], 3) +
           " ms apart, faster than any camera";
  std::size_t backwards = 0;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    backwards += stamps[i] < stamps[i - 1];
  // A list from the last image to the first is as good; one that is not sorted can be sorted,
  // unless the names say that its order is right.
  if (names_rise && backwards > 0 && backwards + 1 < stamps.size())
    return "they run backwards " + std::to_string(backwards) + " times where the names count up";
  return {};
}

} // namespace bundle_icp
