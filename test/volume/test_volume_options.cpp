// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"
#include "volume/color_gains.h"

#include <bundle_icp/volume/extract_surface.h>
#include <bundle_icp/volume/object_region.h>

#include <gtest/gtest.h>

#include <limits>

using namespace bundle_icp;

namespace {

const double INF = std::numeric_limits<double>::infinity();

/** What isValid() says: nothing for options that are valid. */
template <typename Options, typename Change>
std::string
errorOf(Change change)
{
  Options options;
  change(options);
  std::string error;
  const bool is_valid = options.isValid(&error);
  EXPECT_EQ(is_valid, options.isValid()); // without a place for the reason
  EXPECT_EQ(is_valid, error.empty());
  return error;
}

/** A field takes both ends of its range, and neither what lies beyond them nor NaN. */
template <typename Options, typename Set>
void
expectRange(Set set, double low, double high, const std::string& name)
{
  const double reach = 1e-6 * (high - low);
  for (const double value : {low, high})
    EXPECT_EQ(errorOf<Options>([&](Options& o) { set(o, value); }), "") << name << " " << value;
  for (const double value : {low - reach, high + reach, INF, -INF, double(NAN)})
    EXPECT_CONTAINS(errorOf<Options>([&](Options& o) { set(o, value); }), name);
}

} // namespace

TEST(VolumeOptions, TSDFOptionsTakeTheirRangesToTheEnds)
{
  using O = TSDFOptions;
  expectRange<O>(
      [](O& o, double value) {
        o.voxel_size = value;
        o.truncation = 8 * value;
      },
      0.0001, 1, "TSDFOptions: voxel_size ");
  expectRange<O>([](O& o, double value) { o.truncation = value; }, 2 * 0.005, 100 * 0.005,
                 "TSDFOptions: truncation ");
  EXPECT_EQ(errorOf<O>([](O& o) { o.max_depth = 1000; }), "");
  EXPECT_EQ(errorOf<O>([](O& o) { o.max_depth = 1001; }),
            "TSDFOptions: depth range 0.1 to 1001 m; expected 0 < min_depth < max_depth <= 1000");
  EXPECT_CONTAINS(errorOf<O>([](O& o) { o.min_depth = 0; }), "depth range 0 to 5 m");
  EXPECT_CONTAINS(errorOf<O>([](O& o) { o.min_depth = 5; }), "depth range 5 to 5 m");
  EXPECT_CONTAINS(errorOf<O>([](O& o) { o.max_depth = NAN; }), "depth range 0.1 to nan m");
  EXPECT_EQ(errorOf<O>([](O& o) { o.smoothing_radius = 10; }), "");
  EXPECT_EQ(errorOf<O>([](O& o) { o.smoothing_radius = -1; }),
            "TSDFOptions: smoothing_radius -1 px; expected 0 to 10");
  EXPECT_EQ(errorOf<O>([](O& o) { o.num_threads = -1; }),
            "TSDFOptions: num_threads -1; expected 0 (all) or more");
}

TEST(VolumeOptions, ColorCorrectionsTakeTheirRangesToTheEnds)
{
  using C = ColorCorrection;
  for (int channel = 0; channel < 3; ++channel)
    for (const float gain : {0.05f, 20.0f})
      EXPECT_EQ(errorOf<C>([&](C& c) { c.gain[channel] = gain; }), "");
  for (int channel = 0; channel < 3; ++channel)
    for (const float gain : {0.049f, 20.1f, -1.0f, NAN, INFINITY})
      EXPECT_EQ(errorOf<C>([&](C& c) { c.gain[channel] = gain; }),
                "ColorCorrection: gain must lie in 0.05 ... 20");
  EXPECT_EQ(errorOf<C>([](C& c) { c.weight = 1e-6f; }), "");
  EXPECT_EQ(errorOf<C>([](C& c) { c.weight = 0; }),
            "ColorCorrection: weight 0; expected above 0 to 1");
  EXPECT_CONTAINS(errorOf<C>([](C& c) { c.weight = 1.001f; }), "weight 1.001;");
  EXPECT_CONTAINS(errorOf<C>([](C& c) { c.weight = NAN; }), "weight nan;");
}

TEST(VolumeOptions, ColorGainOptionsTakeTheirRangesToTheEnds)
{
  using O = ColorGainOptions;
  expectRange<O>([](O& o, double value) { o.color_sigma = value; }, 0.001, 1,
                 "ColorGainOptions: color_sigma must lie in 0.001 ... 1");
  expectRange<O>([](O& o, double value) { o.gain_sigma = value; }, 0.001, 1,
                 "ColorGainOptions: gain_sigma must lie in 0.001 ... 1");
  for (const int valid : {1, 100})
    EXPECT_EQ(errorOf<O>([&](O& o) { o.iterations = valid; }), "");
  for (const int invalid : {0, 101})
    EXPECT_EQ(errorOf<O>([&](O& o) { o.iterations = invalid; }),
              "ColorGainOptions: iterations must lie in 1 ... 100");
}

TEST(VolumeOptions, MeshOptionsNameTheFieldAndItsRange)
{
  using O = MeshOptions;
  EXPECT_EQ(errorOf<O>([](O& o) { o.min_weight = 1e9; }), "");
  EXPECT_EQ(errorOf<O>([](O& o) { o.min_weight = -1; }),
            "MeshOptions: min_weight -1.000000; expected a number > 0");
  for (const double invalid : {INF, double(NAN)})
    EXPECT_CONTAINS(errorOf<O>([&](O& o) { o.min_weight = invalid; }), "MeshOptions: min_weight ");
  EXPECT_EQ(errorOf<O>([](O& o) { o.iso_level = 0.999; }), "");
  EXPECT_EQ(errorOf<O>([](O& o) { o.iso_level = 1; }),
            "MeshOptions: iso_level 1.000000; expected 0 to below 1");
  EXPECT_CONTAINS(errorOf<O>([](O& o) { o.iso_level = NAN; }), "MeshOptions: iso_level ");
  EXPECT_EQ(errorOf<O>([](O& o) { o.num_threads = -3; }),
            "MeshOptions: num_threads -3; expected 0 (all) or more");
}

TEST(VolumeOptions, ObjectRegionOptionsTakeTheirRangesToTheEnds)
{
  using O = ObjectRegionOptions;
  expectRange<O>(
      [](O& o, double value) {
        o.cell_size = value;
        o.cluster_tolerance = 3 * value;
      },
      0.001, 0.1, "ObjectRegionOptions: cell_size ");
  expectRange<O>([](O& o, double value) { o.max_depth = value; }, 0.2, 100,
                 "ObjectRegionOptions: max_depth ");
  expectRange<O>(
      [](O& o, double value) {
        o.plane_tolerance = value;
        o.min_height = 0.3;
      },
      0.001, 0.2, "ObjectRegionOptions: plane_tolerance ");
  expectRange<O>([](O& o, double value) { o.min_plane_share = value; }, 0, 1,
                 "ObjectRegionOptions: min_plane_share ");
  expectRange<O>([](O& o, double value) { o.min_height = value; }, 0.015, 1,
                 "ObjectRegionOptions: min_height ");
  expectRange<O>([](O& o, double value) { o.cluster_tolerance = value; }, 0.01, 20 * 0.01,
                 "ObjectRegionOptions: cluster_tolerance ");
  expectRange<O>([](O& o, double value) { o.view_angle = value; }, 0.01, 1,
                 "ObjectRegionOptions: view_angle ");
  expectRange<O>([](O& o, double value) { o.margin = value; }, 0, 1,
                 "ObjectRegionOptions: margin ");
  EXPECT_EQ(errorOf<O>([](O& o) { o.max_height = 100; }), "");
  EXPECT_CONTAINS(errorOf<O>([](O& o) { o.max_height = 101; }),
                  "max_height 101; expected 0.025 to 100");
  EXPECT_EQ(errorOf<O>([](O& o) { o.min_cells = 1; }), "");
  EXPECT_CONTAINS(errorOf<O>([](O& o) { o.min_cells = 0; }), "min_cells 0; expected 1 to 1e+09");
}
