// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/prior_motions.h"

#include "landmarks.h"

#include <gtest/gtest.h>

#include <numeric>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr double POSITION_SIGMA = 0.004, ROTATION_SIGMA = 0.003;

/** Frames without features on a path with steps of 5 cm and 3 degrees, which the model knows
 *  exactly. Errors of the prior add up from frame to frame. */
struct Path {
  SparseModel model;
  std::vector<std::size_t> frames;
  std::vector<ImageNode> nodes;
  std::mt19937 random{4};

  explicit Path(std::size_t count = 40) : model(count), frames(count)
  {
    std::iota(frames.begin(), frames.end(), 0);
    Pose pose = Pose::Identity();
    for (std::size_t i = 0; i < count; ++i) {
      nodes.push_back({noFeatures(), 0.1 * double(i)});
      model.registerFrame(i, pose, 0);
      pose = pose * randomMotion(unsigned(i), 0.05, 0.05);
    }
  }

  /** A prior with errors of so many times the deviations that it says. */
  Path&
  addPrior(double factor)
  {
    std::normal_distribution<double> normal(0, factor);
    Pose pose = randomMotion(7, 1, 3); // any world
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (i > 0) {
        Pose step = model.worldFromCamera(i - 1).inverse() * model.worldFromCamera(i);
        Vector6d turn = Vector6d::Zero();
        for (int axis = 0; axis < 3; ++axis) {
          turn[axis] = ROTATION_SIGMA * normal(random);
          step.translation()[axis] += POSITION_SIGMA * normal(random);
        }
        step.linear() = step.linear() * increment(turn).linear();
        pose = pose * step;
      }
      nodes[i].prior = PosePrior{pose, POSITION_SIGMA, ROTATION_SIGMA};
    }
    return *this;
  }

  ImageGraph
  graph() const
  {
    ImageGraph result(smallCamera());
    result.append(nodes, true);
    return result;
  }
};

std::vector<RelativePoseTerm>
measuredTerms(const Path& path, PosePriorReport& report)
{
  const ImageGraph graph = path.graph();
  PriorMotions motions(graph, MapperOptions());
  motions.measure(path.model, path.frames);
  report = motions.trust().report;
  return motions.terms(path.model, path.frames);
}

} // namespace

TEST(PriorMotions, DeviationsGrowWithTheRootOfTheSteps)
{
  const Path path = Path().addPrior(0);
  const ImageGraph graph = path.graph();
  PriorMotions motions(graph, MapperOptions());
  EXPECT_FALSE(motions.between(2, 3)); // nothing was measured
  motions.measure(path.model, path.frames);
  for (const std::size_t steps : {1, 4, 9}) {
    const auto motion = motions.between(5, 5 + steps);
    ASSERT_TRUE(motion);
    EXPECT_NEAR(motion->position_sigma, POSITION_SIGMA * std::sqrt(steps), 1e-12);
    EXPECT_NEAR(motion->rotation_sigma, ROTATION_SIGMA * std::sqrt(steps), 1e-12);
    const Pose exact =
        path.model.worldFromCamera(5).inverse() * path.model.worldFromCamera(5 + steps);
    EXPECT_TRUE(motion->first_from_second.isApprox(exact, 1e-9));
    EXPECT_NEAR(motions.between(5 + steps, 5)->position_sigma, motion->position_sigma, 1e-12);
  }
  EXPECT_EQ(motions.terms(path.model, {0, 10, 20}).size(), 2u);
}

TEST(PriorMotions, PositionAndRotationAreIndependentEvidence)
{
  const PriorMotion motion{randomMotion(1, 0.5, 0.7), POSITION_SIGMA, ROTATION_SIGMA};
  const RelativePoseTerm term = motion.term(3, 4);
  EXPECT_EQ(term.first, 3u);
  EXPECT_EQ(term.second, 4u);
  EXPECT_FALSE(term.is_dense);
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Vector6d delta = logarithm(randomMotion(seed, 1e-5, 1e-5));
    const Pose moved = increment(delta) * motion.first_from_second;
    const double position =
        (moved.translation() - motion.first_from_second.translation()).norm() / POSITION_SIGMA;
    const double rotation = delta.head<3>().norm() / ROTATION_SIGMA;
    const double expected = position * position + rotation * rotation;
    EXPECT_NEAR(delta.dot(term.information * delta), expected, 1e-3 * expected);
  }
}

TEST(PriorMotions, AnHonestPriorIsTakenAtItsWord)
{
  PosePriorReport report;
  const auto terms = measuredTerms(Path(200).addPrior(1), report);
  EXPECT_EQ(report.frames, 200u);
  EXPECT_EQ(report.motions, 199u);
  EXPECT_LE(report.left_out, 5u);
  EXPECT_EQ(terms.size(), report.motions - report.left_out);
  EXPECT_EQ(report.said_position, POSITION_SIGMA);
  EXPECT_NEAR(report.measured_position, POSITION_SIGMA, 0.15 * POSITION_SIGMA);
  EXPECT_NEAR(report.measured_rotation, ROTATION_SIGMA, 0.15 * ROTATION_SIGMA);
}

TEST(PriorMotions, DeviationsGrowToTheErrorsThatTheDataShow)
{
  PosePriorReport report;
  const auto terms = measuredTerms(Path(200).addPrior(3), report);
  EXPECT_NEAR(report.measured_position, 3 * POSITION_SIGMA, 0.5 * POSITION_SIGMA);
  EXPECT_NEAR(report.measured_rotation, 3 * ROTATION_SIGMA, 0.5 * ROTATION_SIGMA);
  EXPECT_LE(report.left_out, 5u);
  ASSERT_FALSE(terms.empty());
  const double sigma = 1 / std::sqrt(terms.front().information(3, 3));
  EXPECT_NEAR(sigma, report.measured_position, 1e-9);
}

TEST(PriorMotions, DeviationsNeverShrinkUntilTheyAreForgotten)
{
  const Path path = Path(60).addPrior(3);
  const ImageGraph graph = path.graph();
  PriorMotions motions(graph, MapperOptions());
  motions.measure(path.model, path.frames);
  const double before = motions.between(0, 1)->position_sigma;
  SparseModel pulled = path.model; // to the prior, as after an adjustment with it
  for (const std::size_t frame : path.frames)
    pulled.setWorldFromCamera(frame, path.nodes[frame].prior->world_from_camera);
  motions.measure(pulled, path.frames);
  EXPECT_EQ(motions.between(0, 1)->position_sigma, before);
  motions.forget();
  EXPECT_FALSE(motions.between(0, 1));
  motions.measure(pulled, path.frames);
  EXPECT_LT(motions.between(0, 1)->position_sigma, 0.5 * before);
}

TEST(PriorMotions, AMotionThatContradictsTheDataIsLeftOut)
{
  Path path = Path().addPrior(0.5);
  for (std::size_t i = 20; i < path.nodes.size(); ++i) { // tracking was lost, and began elsewhere
    Pose& pose = path.nodes[i].prior->world_from_camera;
    pose = randomMotion(3, 0.5, 0.5) * pose;
  }
  PosePriorReport report;
  const auto terms = measuredTerms(path, report);
  EXPECT_EQ(report.left_out, 1u);
  for (const RelativePoseTerm& term : terms)
    EXPECT_NE(term.second, 20u);
}

TEST(PriorMotions, WhatIsAsWrongAsTheMotionIsLongSaysNothing)
{
  Path path = Path().addPrior(1);
  for (std::size_t i = 0; i < path.nodes.size(); ++i)
    path.nodes[i].prior->world_from_camera = randomMotion(unsigned(100 + i), 1, 1);
  PosePriorReport report;
  EXPECT_TRUE(measuredTerms(path, report).empty());
  EXPECT_FALSE(report.uses_position || report.uses_rotation);
  EXPECT_EQ(report.left_out, 0u);
  EXPECT_GT(report.measured_position, 10 * POSITION_SIGMA);
}

TEST(PriorMotions, ACompassHelpsWithRotationAlone)
{
  Path path = Path().addPrior(1);
  for (ImageNode& node : path.nodes)
    node.prior->world_from_camera.translation().setZero();
  PosePriorReport report;
  const auto terms = measuredTerms(path, report);
  EXPECT_FALSE(report.uses_position);
  EXPECT_TRUE(report.uses_rotation);
  ASSERT_FALSE(terms.empty());
  EXPECT_TRUE((terms.front().information.bottomRightCorner<3, 3>().isZero()));
  EXPECT_GT(terms.front().information(0, 0), 0);
}

TEST(PriorMotions, ItsWorldMayBeAnyOne)
{
  Path path = Path().addPrior(1), moved = path;
  for (ImageNode& node : moved.nodes)
    node.prior->world_from_camera = randomMotion(9, 2, 50) * node.prior->world_from_camera;
  PosePriorReport report, same;
  const auto terms = measuredTerms(path, report), others = measuredTerms(moved, same);
  ASSERT_EQ(terms.size(), others.size());
  for (std::size_t k = 0; k < terms.size(); ++k)
    EXPECT_TRUE(terms[k].first_from_second.isApprox(others[k].first_from_second, 1e-9));
  EXPECT_NEAR(report.measured_position, same.measured_position, 1e-9);
}

TEST(PriorMotions, FramesWithoutOneAndPriorsThatAreOffGiveNothing)
{
  Path path = Path().addPrior(0.5);
  path.nodes[10].prior.reset();
  PosePriorReport report;
  EXPECT_EQ(measuredTerms(path, report).size(), 37u);
  EXPECT_EQ(report.frames, 39u);
  const ImageGraph graph = path.graph();
  MapperOptions off, unordered;
  off.refinement.pose_prior = false;
  unordered.schedule.ordered_in_time = false;
  for (const MapperOptions& options : {off, unordered}) {
    PriorMotions motions(graph, options);
    motions.measure(path.model, path.frames);
    EXPECT_EQ(motions.trust().report.motions, 0u);
    EXPECT_EQ(motions.trust().report.frames, options.refinement.pose_prior ? 39u : 0u);
    EXPECT_TRUE(motions.terms(path.model, path.frames).empty());
  }
}
