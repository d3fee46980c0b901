// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Poses that a recording brings: as a prior they help where data are weak, and do no harm when they
// are wrong; as they are they give the surface.
#include "messages.h"
#include "scan/frames.h"

#include <bundle_icp/evaluation/trajectory_error.h>
#include <bundle_icp/mesh/surface_mesh.h>

#include <algorithm>
#include <optional>
#include <random>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Frames of the room with prior poses; dark ones have no features. */
class FramesWithPrior : public Frames {
public:
  using Priors = std::vector<std::optional<PosePrior>>; ///< by frame of the room

  FramesWithPrior(std::vector<std::size_t> frames, std::set<std::size_t> dark, Priors priors)
  : Frames(std::move(frames)), dark_(std::move(dark)), priors_(std::move(priors))
  {
  }

  RGBDFrame
  read(std::size_t index) const override
  {
    RGBDFrame frame = Frames::read(index);
    if (dark_.count(id(index)))
      frame.color = cv::Mat::zeros(frame.color.size(), frame.color.type());
    return frame;
  }

  std::optional<PosePrior>
  prior(std::size_t index) const override
  {
    return priors_.empty() ? std::nullopt : priors_[id(index)];
  }

private:
  std::set<std::size_t> dark_;
  Priors priors_;
};

/** Poses of the room's frames whose errors of 1 mm and 1 mrad add up, in a world of their own; with
 *  deviations for steps of up to nine of these frames. */
FramesWithPrior::Priors
goodPriors()
{
  constexpr double sigma = 0.001;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  FramesWithPrior::Priors priors;
  Pose pose(Eigen::Translation3d(3, -2, 1) *
            Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized()));
  for (std::size_t i = 0; i < room().size(); ++i) {
    if (i > 0) {
      Vector6d error;
      for (double& value : error)
        value = sigma * normal(random);
      pose = pose * room().worldFromCamera(i - 1).inverse() * room().worldFromCamera(i) *
             increment(error);
    }
    priors.push_back(PosePrior{pose, 3 * sigma, 3 * sigma});
  }
  return priors;
}

double
trajectoryError(const ReconstructionResult& result)
{
  const auto error = absoluteTrajectoryError(room().groundTruth(), result.trajectory());
  return error ? error->translation.rmse : 1e9;
}

std::size_t
numRegistered(const ReconstructionResult& result)
{
  return result.component_sizes.empty() ? 0 : result.component_sizes.front();
}

std::optional<Finding>
findingOf(const ReconstructionResult& result, const std::string& kind)
{
  for (const Finding& finding : result.findings)
    if (finding.kind == kind)
      return finding;
  return std::nullopt;
}

ReconstructionResult
reconstructed(const FramesWithPrior::Priors& priors, const std::vector<std::size_t>& frames,
              const std::set<std::size_t>& dark = {})
{
  return reconstruct(FramesWithPrior(frames, dark, priors), withoutMesh());
}

double
largestDifference(const ReconstructionResult& a, const ReconstructionResult& b)
{
  double largest = 0;
  for (const FrameReport& frame : a.frames)
    for (const FrameReport& other : b.frames)
      if (other.id == frame.id) {
        EXPECT_EQ(other.registered, frame.registered) << frame.id;
        largest =
            std::max(largest, (other.world_from_camera.matrix() - frame.world_from_camera.matrix())
                                  .cwiseAbs()
                                  .maxCoeff());
      }
  return largest;
}

} // namespace

TEST(PosePrior, HelpsWhereFramesHaveNoFeatures)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "too slow with sanitizers";
#endif
  const std::vector<std::size_t> frames{0, 3, 6, 9, 12, 15, 18, 21, 24, 27};
  const std::set<std::size_t> dark{12, 15, 24, 27};
  const ReconstructionResult without = reconstructed({}, frames, dark);
  const ReconstructionResult with = reconstructed(goodPriors(), frames, dark);
  EXPECT_GE(numRegistered(with), numRegistered(without));
  EXPECT_LE(trajectoryError(with), std::max(1.05 * trajectoryError(without), 1e-3));
  const auto finding = findingOf(with, "pose_prior");
  ASSERT_TRUE(finding);
  EXPECT_EQ(finding->severity, Severity::NOTE) << finding->what;
  EXPECT_EQ(with.pose_prior.frames, frames.size());
  EXPECT_TRUE(with.pose_prior.uses_position && with.pose_prior.uses_rotation);
  EXPECT_FALSE(findingOf(without, "pose_prior"));
}

TEST(PosePrior, AWrongOneDoesNoHarmAndIsNamed)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "too slow with sanitizers";
#endif
  const double without = trajectoryError(reference());
  FramesWithPrior::Priors random = goodPriors(), other_path = goodPriors();
  std::mt19937 generator(3);
  std::normal_distribution<double> normal(0, 0.5);
  SyntheticScanOptions elsewhere;
  elsewhere.start_time = 30;
  elsewhere.seed = 8;
  const SyntheticScan other(elsewhere);
  for (std::size_t i = 0; i < random.size(); ++i) {
    Vector6d motion;
    for (double& value : motion)
      value = normal(generator);
    random[i]->world_from_camera = increment(motion);
    other_path[i]->world_from_camera = other.worldFromCamera(i);
  }
  for (const auto& priors : {random, other_path}) {
    const ReconstructionResult result = reconstructed(priors, everyFourth());
    EXPECT_EQ(numRegistered(result), numRegistered(reference()));
    EXPECT_NEAR(trajectoryError(result), without, 0.05 * without);
    const auto finding = findingOf(result, "pose_prior");
    ASSERT_TRUE(finding);
    EXPECT_EQ(finding->severity, Severity::WARNING) << finding->what;
    EXPECT_EQ(result.verdict(), Verdict::USABLE);
  }
}

TEST(PosePrior, NeitherOrderNorItsWorldMatter)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "too slow with sanitizers";
#endif
  const ReconstructionResult result = reconstructed(goodPriors(), everyFourth(), {16});
  EXPECT_LT(
      largestDifference(result, reconstructed(goodPriors(), {20, 4, 28, 0, 12, 24, 16, 8}, {16})),
      1e-4);
  FramesWithPrior::Priors moved = goodPriors();
  const Pose other_world(Eigen::Translation3d(10, 20, -5) *
                         Eigen::AngleAxisd(2, Eigen::Vector3d::UnitY()));
  for (auto& prior : moved)
    prior->world_from_camera = other_world * prior->world_from_camera;
  EXPECT_LT(largestDifference(result, reconstructed(moved, everyFourth(), {16})), 1e-6);
}

TEST(PosePrior, InvalidOnesAreRefused)
{
  FramesWithPrior::Priors priors = goodPriors();
  priors[4]->position_sigma = 0;
  const FramesWithPrior frames({0, 4}, {}, priors);
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] { reconstruct(frames, withoutMesh()); }),
                  "frame 4: the position sigma of a prior pose must be finite and > 0");
}

namespace {

/** With the true poses of the room's frames 4 to 28. */
ReconstructionOptions
withTruePoses()
{
  ReconstructionOptions options;
  options.volume.voxel_size = 0.01;
  options.volume.truncation = 0.04;
  options.poses.emplace();
  options.poses->source = "poses.txt";
  for (std::size_t i = 4; i <= 28; ++i)
    options.poses->trajectory.push_back({room().timestamp(i), room().worldFromCamera(i)});
  return options;
}

} // namespace

TEST(GivenPoses, GiveTheTrueSurfaceInTheirWorld)
{
  const ReconstructionResult result = reconstruct(Frames(everyFourth()), withTruePoses());
  EXPECT_EQ(result.status, ReconstructionStatus::COMPLETED);
  EXPECT_EQ(result.component_sizes, std::vector<std::size_t>{7});
  EXPECT_FALSE(result.graph);
  for (const FrameReport& frame : result.frames) {
    EXPECT_EQ(frame.registered, frame.id >= 4);
    EXPECT_EQ(frame.verdict, frame.id >= 4 ? FrameVerdict::UNCHECKED : FrameVerdict::LEFT_OUT);
    if (frame.registered) {
      EXPECT_EQ(frame.world_from_camera.matrix(), room().worldFromCamera(frame.id).matrix());
    }
    else {
      EXPECT_CONTAINS(frame.reason, "no pose within 0.02 s: poses.txt");
    }
  }
  const auto finding = findingOf(result, "given_poses");
  ASSERT_TRUE(finding);
  EXPECT_CONTAINS(finding->what, "7 of 8 frames have a pose from poses.txt");
  const SurfaceMesh mesh = toSurfaceMesh(result.mesh);
  ASSERT_GT(mesh.vertices.size(), 1000u);
  std::vector<double> distances;
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    distances.push_back(room().distanceToSurface(vertex.cast<double>()));
  std::sort(distances.begin(), distances.end());
  EXPECT_LT(distances[distances.size() / 2], 0.002);
  EXPECT_LT(distances[distances.size() * 95 / 100], 0.01);
}

TEST(GivenPoses, ThatCannotServeAreRefused)
{
  const Frames frames({0, 4});
  const auto refusal = [&](const ReconstructionOptions& options) {
    return messageOf<pcl::BadArgumentException>([&] { reconstruct(frames, options); });
  };
  ReconstructionOptions late = withTruePoses(), bent = late, empty = late, tracked = late;
  for (TimedPose& pose : late.poses->trajectory)
    pose.timestamp += 100;
  EXPECT_CONTAINS(refusal(late), "poses.txt: no pose is within 0.02 s of a frame");
  bent.poses->trajectory[2].world_from_camera.linear() *= 1.1;
  EXPECT_CONTAINS(refusal(bent), "is not a rigid motion");
  empty.poses->trajectory.clear();
  EXPECT_CONTAINS(refusal(empty), "the trajectory is empty");
  tracked.method = ReconstructionMethod::F2M_ICP;
  EXPECT_CONTAINS(refusal(tracked), "need no method");
}
