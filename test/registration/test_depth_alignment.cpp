// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/depth_alignment.h"

#include "scenes.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

DepthAlignment::View
viewOf(std::size_t frame)
{
  return std::make_shared<const DepthView>(
      makeDepthView(room().readExact(frame).depth, room().camera()));
}

Eigen::Vector3d
pointOf(const PointsView& view, std::size_t i)
{
  return Eigen::Map<const Eigen::Vector3f>(view.xyz + i * view.stride).cast<double>();
}

/** Median distance [px] of points from their pixels, as seen from a pose. */
double
medianOffset(const PointsView& view, const Pose& world_from_virtual)
{
  std::vector<double> offsets;
  const CameraIntrinsics& camera = room().camera();
  for (std::size_t i = 0; i < view.size; i += 7) {
    const Eigen::Vector3d p = world_from_virtual.inverse() * pointOf(view, i);
    const auto width = std::size_t(view.width);
    if (p.allFinite())
      offsets.push_back(
          (camera.project(p) - Eigen::Vector2d(double(i % width), double(i / width))).norm());
  }
  EXPECT_FALSE(offsets.empty());
  std::nth_element(offsets.begin(), offsets.begin() + std::ptrdiff_t(offsets.size() / 2),
                   offsets.end());
  return offsets[offsets.size() / 2];
}

} // namespace

TEST(DepthAlignment, SourceIsTheImageInItsCameraFrame)
{
  const DepthAlignment::View view = viewOf(3);
  VirtualDepthOptions options;
  options.num_threads = 3;
  const DepthAlignment alignment(view, options);
  const AlignmentProblem& problem = alignment.problem();
  EXPECT_EQ(problem.num_threads, 3);
  ASSERT_TRUE(problem.camera);
  EXPECT_EQ(problem.camera->fx, view->camera.fx);
  EXPECT_EQ(problem.source.width, view->camera.width);
  EXPECT_EQ(problem.source.height, view->camera.height);
  EXPECT_LT(medianOffset(problem.source, Pose::Identity()), 1e-3);
  EXPECT_TRUE(problem.visual.source.empty());
  EXPECT_FALSE(problem.render);
}

TEST(DepthAlignment, VisualEvidenceIsPassedOn)
{
  DepthAlignment alignment(viewOf(3), {});
  alignment.setVisualEvidence({{{1, 2, 3}}, {{4, 5, 6}}, {7}}, 1.5);
  EXPECT_EQ(alignment.problem().visual.source.front(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(alignment.problem().visual.target.front(), Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(alignment.problem().visual.weights.front(), 7);
  EXPECT_EQ(alignment.problem().visual_scale, 1.5);
}

TEST(DepthAlignment, VirtualDepthIsThatOfTheWorldAndFollowsThePose)
{
  DepthAlignment alignment(viewOf(5), {});
  const Pose start = room().worldFromCamera(5) * randomMotion(1, 0.03, 0.03);
  alignment.setVirtualDepth({viewOf(3), viewOf(4)},
                            {room().worldFromCamera(3), room().worldFromCamera(4)}, start);
  const AlignmentProblem& problem = alignment.problem();
  EXPECT_EQ(problem.world_from_virtual.matrix(), start.matrix());
  EXPECT_LT(medianOffset(problem.target, start), 0.1);
  ASSERT_TRUE(problem.render);
  const Pose moved = start * randomMotion(2, 0.1, 0.1);
  EXPECT_GT(medianOffset(problem.target, moved), 5);
  const std::optional<PointsView> again = problem.render(moved);
  ASSERT_TRUE(again);
  EXPECT_LT(medianOffset(*again, moved), 0.1);
}

TEST(DepthAlignment, KeepsWhatTheProblemRefersTo)
{
  // The views of the caller are gone when the pose has moved and the target is rendered again.
  DepthAlignment alignment(viewOf(5), {});
  const Pose start = room().worldFromCamera(5) * randomMotion(3, 0.05, 0.04);
  {
    std::vector<DepthAlignment::View> views = {viewOf(3), viewOf(4)};
    alignment.setVirtualDepth(views, {room().worldFromCamera(3), room().worldFromCamera(4)}, start);
  }
  const BundleICPResult found = alignPoints(alignment.problem(), start);
  EXPECT_EQ(found.status, BundleICPStatus::CONVERGED) << found.summary();
  EXPECT_GE(found.renderings, 1);
  const Pose error = room().worldFromCamera(5).inverse() * found.world_from_source;
  EXPECT_LT(error.translation().norm(), 0.003);
  EXPECT_LT(degrees(rotationAngle(error)), 0.1);
}

TEST(DepthAlignment, PairsOfImagesGiveTheMotionBetweenThemEitherWay)
{
  const DepthAlignment::View first = viewOf(3), second = viewOf(4);
  const Pose truth = room().worldFromCamera(3).inverse() * room().worldFromCamera(4);
  const Pose near_by = truth * randomMotion(4, 0.005, 0.005);
  DepthAlignment forth(second, {}), back(first, {});
  forth.setView(*first);
  back.setView(*second);
  EXPECT_EQ(forth.problem().max_misalignment, 0) << "the start is near";
  EXPECT_GT(forth.problem().model_share, AlignmentProblem().model_share);
  const BundleICPResult there = alignPoints(forth.problem(), near_by);
  const BundleICPResult again = alignPoints(back.problem(), near_by.inverse());
  ASSERT_EQ(there.status, BundleICPStatus::CONVERGED);
  ASSERT_EQ(again.status, BundleICPStatus::CONVERGED);
  EXPECT_LT(logarithm(truth.inverse() * there.world_from_source).norm(), 1e-3);
  EXPECT_LT(logarithm(there.world_from_source * again.world_from_source).norm(), 1e-3);
  EXPECT_EQ(there.renderings, 0);
}
