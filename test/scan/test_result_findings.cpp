// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/result_findings.h"
#include "scan/result_frames.h"

#include "frames.h"
#include "messages.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Of `all` frames, as many in each component as is said. */
ReconstructionResult
placed(std::size_t all, const std::vector<std::size_t>& component_sizes)
{
  ReconstructionResult result;
  result.frames.resize(all);
  result.component_sizes = component_sizes;
  std::size_t frame = 0;
  for (std::size_t c = 0; c < component_sizes.size(); ++c)
    for (std::size_t i = 0; i < component_sizes[c]; ++i, ++frame) {
      result.frames[frame].registered = true;
      result.frames[frame].component = int(c);
    }
  return result;
}

/** Frames that cannot be read any more after the first time. */
class VanishingFrames : public Frames {
public:
  using Frames::Frames;
  RGBDFrame
  read(std::size_t index) const override
  {
    if (has_vanished)
      throw pcl::IOException(name(index) + ".png is gone");
    return Frames::read(index);
  }
  mutable bool has_vanished = false;
};

} // namespace

TEST(PlacementFindings, SayHowManyFramesHaveNoPose)
{
  EXPECT_TRUE(placementFindings(placed(10, {})).empty());
  EXPECT_TRUE(placementFindings(placed(10, {8})).empty());
  const std::vector<Finding> some = placementFindings(placed(10, {7}));
  ASSERT_EQ(some.size(), 1u);
  EXPECT_EQ(some[0].severity, Severity::WARNING);
  EXPECT_EQ(some[0].what, "3 of 10 frames have no pose in the largest world");
  const std::vector<Finding> most = placementFindings(placed(800, {2, 2, 2}));
  ASSERT_EQ(most.size(), 1u);
  EXPECT_EQ(most[0].severity, Severity::FAULT);
  EXPECT_CONTAINS(most[0].what, "798 of 800 frames");
  EXPECT_CONTAINS(most[0].what, "4 of them have one in another");
}

TEST(UnreadableFindings, FramesThatTheSurfaceLacksAreSaid)
{
  const VanishingFrames frames(everyFourth());
  ReconstructionOptions options;
  options.volume.voxel_size = 0.02;
  options.volume.truncation = 0.08;
  const ReconstructionResult result =
      reconstruct(frames, options, [&frames](const Progress& progress) {
        frames.has_vanished = frames.has_vanished || progress.stage == "registration";
        return true;
      });
  EXPECT_EQ(result.verdict(), Verdict::DOUBTFUL);
  std::string said;
  for (const Finding& finding : result.findings)
    said += finding.what + "\n";
  EXPECT_CONTAINS(said, "8 of 8 frames with a pose could not be read for the surface");
  EXPECT_CONTAINS(said, "the surface is empty: no frame with a pose could be read");
}

TEST(UnreadableFindings, SeverityFollowsTheirShare)
{
  ReconstructionResult result = placed(4, {4});
  EXPECT_TRUE(unreadableFindings(result).empty());
  result.frames[0].reason = "gone";
  ASSERT_EQ(unreadableFindings(result).size(), 1u);
  EXPECT_EQ(unreadableFindings(result)[0].severity, Severity::WARNING);
  result.frames[1].reason = "gone";
  EXPECT_EQ(unreadableFindings(result)[0].severity, Severity::FAULT);
}

TEST(StayingFindings, OfAThingThatDoesNotMove)
{
  StayingPixels staying;
  const auto what = [&staying] { return stayingFindings(staying, MovingPart::OBJECT).at(0).what; };
  EXPECT_CONTAINS(what(), "too few frames, or surroundings too plain");
  staying.share_of_surroundings = 0.3;
  EXPECT_CONTAINS(what(), "only 30 % of the image stays as it is");
  staying.share_of_surroundings = 0.9;
  EXPECT_CONTAINS(what(), "nothing moves before the camera");
  staying.moving_frames = 0.4;
  EXPECT_CONTAINS(what(), "the thing that moves before the camera");
  const std::vector<Finding> findings = stayingFindings(staying, MovingPart::CAMERA);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, Severity::NOTE);
}
