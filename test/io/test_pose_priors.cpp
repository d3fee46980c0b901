// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/bad_format.h"

#include <cmath>

using namespace bundle_icp;
using namespace bad_format;

namespace {

/** Of a camera that moves by 1 m a second, every 0.1 s. */
Trajectory
trajectoryOf(std::size_t count, double start = 0)
{
  Trajectory trajectory;
  for (std::size_t i = 0; i < count; ++i) {
    const double time = start + 0.1 * double(i);
    trajectory.push_back({time, Pose(Eigen::Translation3d(time, 0, 0))});
  }
  return trajectory;
}

DatasetOptions
withPrior(const std::optional<Trajectory>& trajectory)
{
  DatasetOptions options;
  options.pose_prior.emplace();
  options.pose_prior->trajectory = trajectory;
  options.pose_prior->source = "arm.txt";
  return options;
}

using PosePriors = BadFormat;

} // namespace

TEST_F(PosePriors, BelongToFramesByTime)
{
  recordings::writeTum(place, 6); // at 0, 0.1, ... s
  DatasetOptions options = withPrior(trajectoryOf(4, 0.205));
  options.pose_prior->position_sigma = 0.02;
  options.pose_prior->rotation_sigma = 0.01;
  options.shuffle_seed = 3;
  const auto dataset = openDataset(place, options);
  for (std::size_t i = 0; i < dataset->size(); ++i) {
    const auto prior = dataset->prior(i);
    ASSERT_EQ(prior.has_value(), dataset->timestamp(i) > 0.15) << i;
    if (!prior)
      continue;
    EXPECT_NEAR(prior->world_from_camera.translation().x(), dataset->timestamp(i) + 0.005, 1e-9);
    EXPECT_EQ(prior->position_sigma, 0.02);
    EXPECT_EQ(prior->rotation_sigma, 0.01);
  }
  EXPECT_FALSE(openDataset(place)->prior(5));
}

TEST_F(PosePriors, MayBeThoseOfTheDevice)
{
  write("stray-scanner");
  EXPECT_TRUE(findingOf(*openDataset(place), "poses", "they are not used"));
  const auto dataset = openDataset(place, withPrior({}));
  EXPECT_TRUE(findingOf(*dataset, "poses", "they are the prior"));
  const Trajectory poses = dataset->groundTruth();
  ASSERT_EQ(poses.size(), dataset->size());
  for (std::size_t i = 0; i < dataset->size(); ++i) {
    ASSERT_TRUE(dataset->prior(i));
    EXPECT_EQ(dataset->prior(i)->world_from_camera.matrix(), poses[i].world_from_camera.matrix());
  }
}

TEST_F(PosePriors, ThatCannotServeAreRefused)
{
  const auto refusal = [this](const std::string& path, const DatasetOptions& options) {
    return messageOf<pcl::IOException>([&] { openDataset(path, options); });
  };
  write("tum");
  EXPECT_CONTAINS(refusal(place, withPrior({})), place + ": the poses of the recording (TUM RGB-D) "
                                                         "are measured truth, which is no prior");
  EXPECT_CONTAINS(refusal(place, withPrior(trajectoryOf(3, 1000))),
                  "arm.txt: no pose is within 0.02 s of a frame; the times of the poses are 1000 "
                  "... 1000.2 s, those of the frames 0 ... 0.2 s");
  const std::string without = folder.path("open3d");
  recordings::writeOpen3d(without, 2);
  EXPECT_CONTAINS(refusal(without, withPrior({})), "brings no poses that could be a prior");
}

TEST_F(PosePriors, OptionsAreChecked)
{
  const auto reason = [](const DatasetOptions& options) {
    std::string error;
    EXPECT_FALSE(options.isValid(&error));
    return error;
  };
  DatasetOptions options = withPrior({});
  EXPECT_TRUE(options.isValid());
  for (const double sigma : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    options = withPrior({});
    options.pose_prior->position_sigma = sigma;
    EXPECT_CONTAINS(reason(options), "position sigma");
    options = withPrior({});
    options.pose_prior->rotation_sigma = sigma;
    EXPECT_CONTAINS(reason(options), "rotation sigma");
  }
  EXPECT_CONTAINS(reason(withPrior(Trajectory())), "trajectory is empty");
  Trajectory bent = trajectoryOf(2);
  bent[1].world_from_camera.linear() *= 2;
  EXPECT_CONTAINS(reason(withPrior(bent)), "rigid");
}
