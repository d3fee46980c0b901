// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "changes.h"
#include "inputs.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace adversity {
namespace {

const char* const COUNTERS = "counter|numbers are [0-9]+ apart";
const char* const MOMENTS = "other moment|(earlier|later), not on those|do not show the same view|"
                            "counter|pairs? .*wrong|wrong pairs|clocks?";

std::string
padded(const char* format, std::size_t number)
{
  char text[64];
  std::snprintf(text, sizeof(text), format, number);
  return text;
}

/** Names of both streams in Open3D's layout: printf formats with a number. */
std::function<void(Recording&)>
named(const char* color, const char* depth, std::size_t color_start = 0,
      std::size_t depth_start = 0)
{
  return [=](Recording& r) {
    toOpen3d(r);
    rename(r.color, [&](std::size_t i) { return padded(color, i + color_start); });
    rename(r.depth, [&](std::size_t i) { return padded(depth, i + depth_start); });
  };
}

/** Depth stamps by another clock; each image keeps its content. */
std::function<void(Recording&)>
depthClock(double offset)
{
  return [=](Recording& r) {
    for (Image& image : r.depth)
      image.time += offset;
  };
}

std::string
microseconds(const Recording& r, double time)
{
  return padded("%012zu", std::size_t(1e6 * (time - r.color.front().time) + 0.5));
}

/** Redwood's names; each stream numbers its own images, and two depth images are missing. */
void
numberAndTime(Recording& r)
{
  toOpen3d(r);
  r.depth.erase(r.depth.begin() + 7, r.depth.begin() + 9);
  const std::vector<double> times = [&] {
    std::vector<double> result;
    for (const Image& image : r.depth)
      result.push_back(image.time + 0.004);
    return result;
  }();
  rename(r.depth,
         [&](std::size_t i) { return padded("%07zu-", i + 1) + microseconds(r, times[i]); });
  rename(r.color,
         [&](std::size_t i) { return padded("%07zu-", i + 1) + microseconds(r, r.color[i].time); });
}

void
namesAreNanoseconds(Recording& r)
{
  toOpen3d(r);
  const auto name = [](double time) {
    return std::to_string(1700000000000000000 + std::int64_t(1e9 * time));
  };
  rename(r.color, [&](std::size_t i) { return name(r.color[i].time); });
  rename(r.depth, [&](std::size_t i) { return name(r.depth[i].time + 0.006); });
}

/** Depth images of some moments were never written, and the others are numbered without a gap. */
void
missingDepthRenumbered(Recording& r)
{
  toOpen3d(r);
  r.depth.erase(r.depth.begin() + 4);
  r.depth.erase(r.depth.begin() + 2);
  rename(r.depth, [](std::size_t i) { return padded("%04zu", i); });
}

/** Some of the pairs of one list name the depth image four rows on. */
void
someWrongPairs(Recording& r)
{
  r.layout = Layout::ONE_LIST;
  const std::vector<Image> depth = r.depth;
  for (std::size_t i = 2; i + 4 < depth.size(); i += 4)
    r.depth[i].pixels = depth[i + 4].pixels;
}

/** Row i of one list names the depth image `rows` on; at the end it begins anew. */
std::function<void(Recording&)>
wrongPairs(std::size_t rows)
{
  return [=](Recording& r) {
    r.layout = Layout::ONE_LIST;
    const std::vector<Image> depth = r.depth;
    for (std::size_t i = 0; i < depth.size(); ++i)
      r.depth[i].pixels = depth[(i + rows) % depth.size()].pixels;
  };
}

/** The names in rgb.txt stand one row too early. */
void
colorListShifted(Recording& r)
{
  for (std::size_t i = r.color.size() - 1; i > 0; --i)
    r.color[i].time = r.color[i - 1].time;
  r.color.erase(r.color.begin());
}

void
depthAtHalfTheRate(Recording& r)
{
  r.depth = everyNth(r, 2).depth;
}

} // namespace

std::vector<Input>
pairingInputs()
{
  const std::vector<std::string> table = {"table"}, both = {"table", "desk"};
  const auto depthReversed = [](Recording& r) {
    toOpen3d(r);
    const std::size_t number = r.depth.size();
    rename(r.depth, [&](std::size_t i) { return padded("%04zu", number - 1 - i); });
  };
  const auto noDepthForSome = [](Recording& r) {
    toOpen3d(r);
    r.depth.erase(r.depth.begin() + 5, r.depth.begin() + 9);
    r.color.erase(r.color.begin() + 15);
  };
  const auto tumWithoutLists = [](Recording& r) {
    r.layout = Layout::TUM;
    for (std::vector<Image>* images : {&r.color, &r.depth})
      for (Image& image : *images)
        image.name = std::to_string(1.6e9 + image.time);
    r.afterwards = [](const std::string& folder) {
      for (const char* name : {"/rgb.txt", "/depth.txt"})
        std::remove((folder + name).c_str());
    };
  };
  return {
      {"clean_open3d", both, toOpen3d, ""},
      {"clean_one_list", table, [](Recording& r) { r.layout = Layout::ONE_LIST; }, ""},
      {"counters_differ", both, named("%06zu", "%06zu", 57625, 57619), COUNTERS, 0.5, true},
      {"counters_differ_by_one", both, named("%06zu", "%06zu", 1, 0), MOMENTS},
      {"digit_in_prefix", table, named("A_hat1_color_frame%zu", "A_hat1_depth_frame%zu"), ""},
      {"prefixes_differ", table, named("cam0_rgb_%zu_take3", "cam1_d_%zu_take3"), ""},
      {"number_and_time", both, numberAndTime, "", 0.5, true},
      {"names_are_nanoseconds", table, namesAreNanoseconds, ""},
      {"depth_counts_down", table, depthReversed, MOMENTS},
      {"no_depth_for_some", table, noDepthForSome, ""},
      {"missing_depth_renumbered", both, missingDepthRenumbered, MOMENTS},
      {"color_list_shifted", both, colorListShifted, MOMENTS},
      {"one_list_wrong_pairs", both, wrongPairs(5), MOMENTS, 0.5, true},
      {"one_list_next_pairs", table, wrongPairs(1), MOMENTS},
      {"one_list_some_wrong_pairs", both, someWrongPairs, MOMENTS},
      {"clocks_apart_by_a_frame", table, depthClock(0.1), MOMENTS},
      {"clocks_apart_by_a_second", table, depthClock(1), MOMENTS},
      {"clocks_apart_by_minutes", table, depthClock(130), "no overlap in time"},
      {"depth_at_half_the_rate", table, depthAtHalfTheRate, "", 0.4, false, 2},
      {"tum_without_lists", table, tumWithoutLists, "unit"},
  };
}

std::vector<Input>
stampInputs()
{
  const std::vector<std::string> table = {"table"}, both = {"table", "desk"};
  const auto times = [](auto rule) { return [=](Recording& r) { changeTimes(r, rule); }; };
  const auto format = [](double factor, double start) {
    return [=](Recording& r) {
      r.stamp = [=](double time) { return std::to_string(std::int64_t(factor * (start + time))); };
    };
  };
  const auto depthInMilliseconds = [](Recording& r) {
    changeTimes(r, [](std::size_t, double time) { return 1.6e9 + time; });
    for (Image& image : r.depth)
      image.time *= 1000;
  };
  const auto shuffledTimes = [](Recording& r) {
    std::vector<double> all;
    for (const Image& image : r.color)
      all.push_back(image.time);
    changeTimes(r, [&](std::size_t i, double) { return all[(7 * i + 3) % all.size()]; });
  };
  return {
      {"stamps_all_equal", both, times([](std::size_t, double) { return 1604644894.; }), "", 0.5,
       true},
      {"stamps_zero", table, times([](std::size_t, double) { return 0.; }), ""},
      {"stamps_whole_seconds", both, times([](std::size_t, double t) { return std::floor(t); }),
       ""},
      {"stamps_backwards", table, times([](std::size_t, double t) { return 2000 - t; }), ""},
      {"stamps_random", table, shuffledTimes, ""},
      {"stamps_one_wild", both, times([](std::size_t i, double t) { return i == 9 ? 4.1e9 : t; }),
       ""},
      {"stamps_one_zero", table, times([](std::size_t i, double t) { return i == 9 ? 0 : t; }), ""},
      {"stamps_in_pairs", table,
       times([](std::size_t i, double t) { return t - 0.1 * double(i % 2); }), ""},
      {"stamps_one_repeated", table,
       times([](std::size_t i, double t) { return i == 9 ? t - 0.1 : t; }), ""},
      {"stamps_clock_reset", table,
       times([](std::size_t i, double t) { return i < 12 ? t : t - 500; }), ""},
      {"stamps_ms", both, format(1e3, 1.6e9), ""},
      {"stamps_us", table, format(1e6, 1.6e9), "", 0.5, true},
      {"stamps_ns", both, format(1e9, 1.6e9), ""},
      {"stamps_are_numbers", table, times([](std::size_t i, double) { return double(i + 1); }), ""},
      {"stamps_too_fast", both, times([](std::size_t, double t) { return 1e-3 * t; }), ""},
      {"stamps_too_slow", table, times([](std::size_t, double t) { return 60 * t; }), ""},
      {"stamps_depth_in_ms", table, depthInMilliseconds, ""},
      {"stamps_of_single_precision", table,
       times([](std::size_t, double t) { return double(float(1.6e9 + t)); }), ""},
  };
}

} // namespace adversity
