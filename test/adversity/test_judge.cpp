// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "judge.h"

#include <gtest/gtest.h>

using namespace adversity;

namespace {

constexpr std::size_t NUM_COLORS = 10;
constexpr double LIMIT = 0.01;

const Input spoiled{"spoiled", {"table"}, {}, "wrong unit"};
const Input harmless{"harmless", {"table"}, {}, ""};

Outcome
outcome(int exit_code, double error, const std::string& messages = "", std::size_t num_poses = 10)
{
  return {exit_code, "", messages, num_poses, error};
}

Judgement
judged(const Input& input, const Outcome& outcome)
{
  return judge(input, outcome, NUM_COLORS, LIMIT);
}

} // namespace

TEST(AdversityJudge, ATrustedResultIsRightOrASilentFault)
{
  EXPECT_EQ(judged(spoiled, outcome(0, 0.5 * LIMIT)), Judgement::RIGHT);
  EXPECT_EQ(judged(spoiled, outcome(0, 2 * LIMIT)), Judgement::SILENT_FAULT);
  // A warning does not make up for a wrong result that counts as usable.
  EXPECT_EQ(judged(spoiled, outcome(0, 2 * LIMIT, "wrong unit")), Judgement::SILENT_FAULT);
}

TEST(AdversityJudge, ADoubtfulResultNeedsItsCause)
{
  EXPECT_EQ(judged(spoiled, outcome(3, 2 * LIMIT, "Likely a WRONG UNIT")), Judgement::NAMED);
  EXPECT_EQ(judged(spoiled, outcome(3, 2 * LIMIT, "something moves")), Judgement::MISSED);
  EXPECT_EQ(judged(harmless, outcome(3, 0.5 * LIMIT, "wrong unit")), Judgement::MISSED);
}

TEST(AdversityJudge, ARefusalNeedsItsCause)
{
  const Outcome named{1, "", "wrong unit", 0, std::nullopt}, unnamed{1, "", "", 0, std::nullopt};
  EXPECT_EQ(judged(spoiled, named), Judgement::NAMED);
  EXPECT_EQ(judged(spoiled, unnamed), Judgement::MISSED);
  EXPECT_EQ(judged(harmless, named), Judgement::MISSED);
}

TEST(AdversityJudge, FewPosesAreNoSuccess)
{
  EXPECT_EQ(judged(harmless, outcome(0, 0.5 * LIMIT, "", 4)), Judgement::MISSED);
  EXPECT_EQ(judged(spoiled, outcome(0, 0.5 * LIMIT, "wrong unit", 4)), Judgement::NAMED);
  // Where half of the images repeat others, more cannot be asked for.
  Input repeated = harmless;
  repeated.least_share = 0.4;
  EXPECT_EQ(judged(repeated, outcome(0, 0.5 * LIMIT, "", 4)), Judgement::RIGHT);
}

TEST(AdversityJudge, OtherExitCodesAreCrashes)
{
  for (const int code : {-1, 2, 134})
    EXPECT_EQ(judged(spoiled, outcome(code, 0)), Judgement::CRASHED);
}
