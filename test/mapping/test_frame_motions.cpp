// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/frame_motions.h"

#include "landmarks.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Frames without features at given times, along a path of camera_from_world. */
struct Recording {
  ImageGraph graph{smallCamera()};
  SparseModel model;

  template <typename Path>
  Recording(const std::vector<double>& times, const Path& camera_from_world) : model(times.size())
  {
    std::vector<ImageNode> nodes;
    for (const double time : times)
      nodes.push_back({noFeatures(), time});
    graph.append(nodes, true);
    for (std::size_t i = 0; i < times.size(); ++i)
      model.registerFrame(i, camera_from_world(times[i]).inverse(), 0);
    estimateMotions(graph, 0, model);
  }
};

std::vector<double>
timesAt(double rate, int count)
{
  std::vector<double> times;
  for (int i = 0; i < count; ++i)
    times.push_back(1e5 + i / rate); // as large as real ones
  return times;
}

const double START = 1e5;

/** Stamps of 1e5 s are known to 1e-11 s, and divided by 0.03 s. */
const double TOLERANCE = 1e-7;

} // namespace

TEST(EstimateMotions, RecoversConstantVelocity)
{
  Vector6d motion;
  motion << 0, 0, 0, 0.3, -0.2, 0.5;
  for (const double rate : {5.0, 10.0, 30.0}) {
    const Recording recording(timesAt(rate, 9),
                              [&](double time) { return increment((time - START) * motion); });
    for (std::size_t i = 0; i < 9; ++i)
      EXPECT_LT((recording.model.motion(i) - motion).norm(), TOLERANCE) << i;
  }
}

TEST(EstimateMotions, RecoversConstantRotation)
{
  Vector6d motion;
  motion << 0.5, -0.3, 0.8, 0, 0, 0;
  for (const double rate : {5.0, 10.0, 30.0}) {
    const Recording recording(timesAt(rate, 9),
                              [&](double time) { return increment((time - START) * motion); });
    for (std::size_t i = 0; i < 9; ++i)
      EXPECT_LT((recording.model.motion(i) - motion).norm(), TOLERANCE) << i;
  }
}

TEST(EstimateMotions, TakesPointsInTheCameraFrameAlong)
{
  // What SparseModel::motion() promises, of a camera that turns and moves somewhere in
  // the world
  Vector6d motion;
  motion << 0.5, -0.3, 0.8, 0.3, -0.2, 0.5;
  const Pose start = randomMotion(1, 1, 2);
  const std::vector<double> times = timesAt(30, 9);
  const Recording recording(
      times, [&](double time) { return increment((time - times[4]) * motion) * start; });
  EXPECT_LT((recording.model.motion(4) - motion).norm(), TOLERANCE);
}

TEST(EstimateMotions, ACubicPathIsExactInTheMiddle)
{
  for (const double rate : {4.0, 10.0, 30.0}) {
    const std::vector<double> times = timesAt(rate, 9);
    // At video rate one neighbour on either side takes part: a parabola is exact.
    const double cubic = rate > 20 ? 0 : 1;
    const auto path = [&](double time) {
      const double t = time - times[4];
      Vector6d position;
      position.head<3>() =
          (0.4 * t + 0.9 * t * t - 2 * cubic * t * t * t) * Eigen::Vector3d(0, 0.6, 0.8);
      position.tail<3>() = 0.3 * t * Eigen::Vector3d::UnitX() +
                           0.5 * t * t * Eigen::Vector3d::UnitY() -
                           1.5 * cubic * t * t * t * Eigen::Vector3d::Ones();
      return increment(position);
    };
    Vector6d slope;
    slope << 0, 0.24, 0.32, 0.3, 0, 0;
    EXPECT_LT((Recording(times, path).model.motion(4) - slope).norm(), TOLERANCE);
  }
}

TEST(EstimateMotions, OrderOfImagesDoesNotMatter)
{
  const auto path = [](double time) {
    Vector6d position;
    for (int k = 0; k < 6; ++k)
      position[k] = 0.2 * std::sin((2 + 0.3 * k) * (time - START) + k);
    return increment(position);
  };
  const std::vector<double> times = timesAt(15, 12);
  const std::vector<std::size_t> order{7, 2, 11, 0, 5, 9, 1, 10, 3, 8, 6, 4};
  std::vector<double> shuffled;
  for (const std::size_t i : order)
    shuffled.push_back(times[i]);
  const Recording a(times, path), b(shuffled, path);
  for (std::size_t k = 0; k < order.size(); ++k) {
    EXPECT_GT(a.model.motion(order[k]).norm(), 0.1);
    EXPECT_EQ(a.model.motion(order[k]), b.model.motion(k)) << k;
  }
}

TEST(EstimateMotions, ImagesWithoutNeighboursInTimeDoNotMove)
{
  const auto path = [](double time) {
    return increment((Vector6d() << 0, 0, 0, time, 0, 0).finished());
  };
  const Recording recording({0, 0.1, 0.2, 2, 4, 4.1}, path);
  EXPECT_NEAR(recording.model.motion(1)[3], 1, TOLERANCE);
  EXPECT_EQ(recording.model.motion(3), Vector6d(Vector6d::Zero()));
  EXPECT_NEAR(recording.model.motion(5)[3], 1, TOLERANCE);
}

TEST(EstimateMotions, EqualStampsTellNothing)
{
  int calls = 0;
  const Recording recording(std::vector<double>(4, 1.5),
                            [&calls](double) { return randomMotion(unsigned(calls++), 0.1, 0.1); });
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(recording.model.motion(i), Vector6d(Vector6d::Zero()));
}

TEST(EstimateMotions, LeavesOtherComponentsAlone)
{
  const auto path = [](double time) {
    return increment((Vector6d() << 0, 0, 0, time, 0, 0).finished());
  };
  Recording recording({0, 0.1, 0.2, 0.3, 0.4, 0.5}, path);
  for (const std::size_t i : {1, 3}) { // another world, in between
    recording.model.registerFrame(i, randomMotion(3, 1, 5), 1);
    recording.model.setMotion(i, Vector6d::Constant(7));
  }
  estimateMotions(recording.graph, 0, recording.model);
  for (const std::size_t i : {0, 2, 4, 5})
    EXPECT_NEAR(recording.model.motion(i)[3], 1, TOLERANCE);
  for (const std::size_t i : {1, 3})
    EXPECT_EQ(recording.model.motion(i), Vector6d(Vector6d::Constant(7)));
}
