// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/alignment_terms.h"

#include "frame_pairs.h"
#include "nearest_points.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Turns about the terms' centre and translations by them. */
Pose
moved(const AlignmentTerms& terms, const Vector6d& delta, const Pose& pose)
{
  const Eigen::Translation3d to_center(terms.center());
  return to_center * increment(delta) * to_center.inverse() * pose;
}

Vector6d
translation(double x, double y, double z)
{
  Vector6d delta = Vector6d::Zero();
  delta.tail<3>() << x, y, z;
  return delta;
}

/** Counts how often the target is rendered, and can refuse to. */
struct Renderer {
  AlignmentProblem problem = problemOf(pair());
  int calls = 0;
  bool fails = false;
  Cloud::Ptr last;

  Renderer()
  {
    problem.render = [this](const Pose& pose) -> std::optional<PointsView> {
      ++calls;
      if (fails)
        return std::nullopt;
      const DepthView view = makeDepthView(room().readExact(3).depth, room().camera());
      last = toPointCloud(renderVirtualDepth({{&view, Pose::Identity()}}, room().camera(), pose));
      return viewPoints(*last);
    };
  }
};

} // namespace

TEST(AlignmentTerms, MotionsAreAboutTheMiddleOfTheSource)
{
  AlignmentTerms terms(problemOf(pair()));
  ASSERT_TRUE(terms.prepare(pair().truth));
  EXPECT_TRUE(terms.projective());
  EXPECT_EQ(terms.numLevels(), 3u);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  terms.useLevel(2, 0);
  const SourcePoints& points = terms.source();
  for (std::size_t i = 0; i < points.size(); ++i)
    sum += Eigen::Vector3d(points.x[i], points.y[i], points.z[i]);
  const Eigen::Vector3d expected = pair().truth * (sum / double(points.size()));
  EXPECT_LT((terms.center() - expected).norm(), 1e-9);
}

TEST(AlignmentTerms, LevelsHaveMorePointsAndTheLastOneAll)
{
  AlignmentTerms terms(problemOf(pair()));
  ASSERT_TRUE(terms.prepare(pair().truth));
  std::size_t before = 0;
  for (std::size_t level = 0; level < terms.numLevels(); ++level) {
    terms.useLevel(level, 0);
    EXPECT_GT(terms.source().size(), 3 * before);
    before = terms.source().size();
  }
  EXPECT_GT(before, pair().source->size() / 2);
}

TEST(AlignmentTerms, StepLeadsBackFromASmallMotionOnEveryLevel)
{
  for (const bool projective : {true, false}) {
    AlignmentProblem problem = problemOf(pair());
    std::vector<int> some;
    if (!projective) {
      problem.camera.reset();
      problem.nearest = nearestByComparison(problem.target);
      for (int i = 0; i < int(problem.source.size); i += 97)
        some.push_back(i);
      problem.source_indices = &some;
    }
    AlignmentTerms terms(problem);
    ASSERT_TRUE(terms.prepare(pair().truth));
    ASSERT_EQ(terms.projective(), projective);
    Vector6d delta;
    delta << 0.002, -0.003, 0.001, 0.004, 0.003, -0.005;
    const Pose away = moved(terms, delta, pair().truth);
    for (std::size_t level = projective ? 0 : 2; level < terms.numLevels(); ++level) {
      terms.useLevel(level, 0);
      const AlignmentTerms::Evaluation at = terms.evaluate(away);
      EXPECT_LT((at.step.delta + delta).norm(), 0.3 * delta.norm())
          << "level " << level << (projective ? ", by projection" : ", by nearest points");
      EXPECT_TRUE(at.step.degenerate.empty());
    }
  }
}

TEST(AlignmentTerms, AMisalignedLevelTrustsItsMatchesLess)
{
  AlignmentTerms terms(problemOf(pair()));
  ASSERT_TRUE(terms.prepare(pair().truth));
  double before = 1e300;
  for (const float misalignment : {0.0f, 0.03f, 0.1f, 0.3f}) {
    terms.useLevel(0, misalignment);
    const double weight = terms.evaluate(pair().truth).dense.weight;
    EXPECT_LT(weight, before / 2) << misalignment;
    before = weight;
  }
}

TEST(AlignmentTerms, MeetingIsBestAtTheTruth)
{
  AlignmentTerms terms(problemOf(pair()));
  ASSERT_TRUE(terms.prepare(pair().truth));
  terms.useLevel(1, 0);
  terms.evaluate(pair().truth);
  const Meeting right = terms.meeting(pair().truth, 1);
  EXPECT_GT(right.near, 9 * right.against);
  const Pose wrong = moved(terms, translation(0.1, 0.1, 0.1), pair().truth);
  terms.evaluate(wrong);
  const Meeting off = terms.meeting(wrong, 1);
  EXPECT_LT(off.near, right.near / 2);
  EXPECT_GT(off.against, right.against);
}

TEST(AlignmentTerms, TargetIsRenderedAgainOnlyWhenThePoseHasMovedFar)
{
  Renderer renderer;
  AlignmentTerms terms(renderer.problem);
  ASSERT_TRUE(terms.prepare(Pose::Identity()));
  Vector6d turn = Vector6d::Zero();
  turn[1] = 1.9 * M_PI / 180;
  EXPECT_FALSE(terms.renderAgain(Pose::Identity()));
  EXPECT_FALSE(terms.renderAgain(increment(translation(0.019, 0, 0))));
  EXPECT_FALSE(terms.renderAgain(increment(turn)));
  EXPECT_EQ(renderer.calls, 0);
  EXPECT_TRUE(terms.renderAgain(increment(translation(0.021, 0, 0))));
  EXPECT_EQ(terms.renderings(), 1);
  EXPECT_FALSE(terms.renderAgain(increment(translation(0.03, 0, 0)))) << "9 mm from there";
  turn[1] = 2.1 * M_PI / 180;
  EXPECT_TRUE(terms.renderAgain(increment(translation(0.021, 0, 0)) * increment(turn)));
  EXPECT_EQ(renderer.calls, 2);
}

TEST(AlignmentTerms, TargetIsRenderedFourTimesAtMost)
{
  Renderer renderer;
  AlignmentTerms terms(renderer.problem);
  ASSERT_TRUE(terms.prepare(Pose::Identity()));
  for (int k = 1; k <= 6; ++k)
    EXPECT_EQ(terms.renderAgain(increment(translation(0.03 * k, 0, 0))), k <= 4) << k;
  EXPECT_EQ(renderer.calls, 4);
}

TEST(AlignmentTerms, ARenderingThatFailsLeavesTheOldTarget)
{
  Renderer renderer;
  AlignmentTerms terms(renderer.problem);
  ASSERT_TRUE(terms.prepare(pair().truth));
  terms.useLevel(1, 0);
  const DenseSystem before = terms.evaluate(pair().truth).dense;
  renderer.fails = true;
  EXPECT_FALSE(terms.renderAgain(increment(translation(0.5, 0, 0))));
  EXPECT_EQ(renderer.calls, 1);
  EXPECT_EQ(terms.renderings(), 0);
  EXPECT_EQ(terms.evaluate(pair().truth).dense.g, before.g);
}

TEST(AlignmentTerms, NormalsThatAreNotOfUnitLengthAreNone)
{
  FramePairData unset = pair();
  unset.source.reset(new Cloud(*pair().source));
  unset.target.reset(new Cloud(*pair().target));
  for (const Cloud::Ptr& cloud : {unset.source, unset.target})
    for (Point& point : *cloud)
      point.getNormalVector3fMap().setZero();
  AlignmentTerms terms(problemOf(unset));
  ASSERT_TRUE(terms.prepare(pair().truth));
  terms.useLevel(2, 0);
  const AlignmentTerms::Evaluation at = terms.evaluate(pair().truth);
  EXPECT_TRUE(terms.source().nx.empty());
  EXPECT_GT(at.dense.matched, terms.source().size() / 2) << "the target's were computed";
}

TEST(AlignmentTerms, WithoutAFinitePointNothingIsPrepared)
{
  FramePairData blind = pair();
  blind.source.reset(new Cloud(*pair().source));
  for (Point& point : *blind.source)
    point.x = std::nanf("");
  AlignmentTerms terms(problemOf(blind));
  EXPECT_FALSE(terms.prepare(pair().truth));
}
