// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/verification.h"

#include "noisy_scan.h"

#include <bundle_icp/graph/features.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

using namespace bundle_icp;

namespace {

/** A noisy scan with its true poses, as verification gets it. */
struct VerifiedScan {
  SyntheticScan scan;
  ImageGraph graph;
  std::vector<std::shared_ptr<const DepthView>> views;
  SparseModel model;

  static SyntheticScanOptions
  noisy(std::uint64_t seed)
  {
    SyntheticScanOptions options = test::noisyScan(40, 262.5);
    options.seed = seed;
    options.start_time = 3.0 * double(seed);
    return options;
  }

  /** \param time_scale makes the stamps wrong */
  explicit VerifiedScan(std::uint64_t seed, double time_scale = 1)
  : scan(noisy(seed)), graph(scan.camera()), model(scan.size())
  {
    std::vector<ImageNode> nodes;
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const RGBDFrame frame = scan.read(i);
      nodes.push_back({extractFeatures(frame, scan.camera()), time_scale * frame.timestamp});
      views.push_back(std::make_shared<DepthView>(makeDepthView(frame.depth, scan.camera(), 2)));
    }
    graph.append(std::move(nodes), true);
    for (std::size_t i = 0; i < scan.size(); ++i)
      if (graph.exclusion(i).empty())
        model.registerFrame(i, scan.worldFromCamera(i), 0);
  }

  Verification
  verify(int num_threads = 0) const
  {
    return verifyPoses(
        graph, model, [this](std::size_t i) { return views[i]; }, true, num_threads);
  }

  /** Moves a tenth of the frames by 2 to 10 cm and 1 to 5 degrees. */
  std::set<std::size_t>
  putWrong(unsigned seed)
  {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> centimetres(2, 10), degrees(1, 5);
    std::normal_distribution<double> normal;
    const auto direction = [&] {
      return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    };
    std::vector<std::size_t> frames = model.registeredFrames();
    std::shuffle(frames.begin(), frames.end(), random);
    frames.resize(frames.size() / 10);
    for (const std::size_t frame : frames) {
      Vector6d error;
      error << direction() * (degrees(random) * M_PI / 180),
          direction() * (0.01 * centimetres(random));
      model.setWorldFromCamera(frame, model.worldFromCamera(frame) * increment(error));
    }
    return {frames.begin(), frames.end()};
  }
};

bool
has(const std::vector<Finding>& findings, const std::string& kind)
{
  return std::any_of(findings.begin(), findings.end(),
                     [&kind](const Finding& finding) { return finding.kind == kind; });
}

} // namespace

TEST(VerifyPoses, RightPosesAreGood)
{
  const VerifiedScan scan(1);
  const Verification verification = scan.verify();
  ASSERT_EQ(verification.frames.size(), scan.scan.size());
  for (std::size_t i = 0; i < scan.scan.size(); ++i) {
    const VerifiedFrame& frame = verification.frames[i];
    EXPECT_EQ(frame.verdict,
              scan.model.isRegistered(i) ? FrameVerdict::GOOD : FrameVerdict::LEFT_OUT)
        << i << frame.doubt;
    if (scan.model.isRegistered(i)) {
      EXPECT_GT(frame.depth_agreement, 0.9) << i;
    }
  }
  EXPECT_EQ(verdictOf(verification.findings), Verdict::GOOD);
}

TEST(VerifyPoses, WrongFramesAreDoubtfulAndNoOthers)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  std::size_t wrong = 0, found = 0, right = 0, accused = 0;
  for (unsigned seed = 1; seed < 4; ++seed) {
    VerifiedScan scan(seed);
    const std::set<std::size_t> moved = scan.putWrong(seed);
    const Verification verification = scan.verify();
    for (const std::size_t i : scan.model.registeredFrames()) {
      const bool is_doubtful = verification.frames[i].verdict == FrameVerdict::DOUBTFUL;
      EXPECT_EQ(is_doubtful, !verification.frames[i].doubt.empty());
      (moved.count(i) ? wrong : right) += 1;
      (moved.count(i) ? found : accused) += is_doubtful;
    }
    EXPECT_TRUE(has(verification.findings, "doubtful_frames"));
    EXPECT_NE(verdictOf(verification.findings), Verdict::GOOD);
  }
  EXPECT_GE(double(found), 0.95 * double(wrong)) << wrong;
  EXPECT_LE(double(accused), 0.01 * double(right)) << right;
}

TEST(VerifyPoses, DoesNotDependOnThreads)
{
  VerifiedScan scan(2);
  scan.putWrong(5);
  const Verification one = scan.verify(1), two = scan.verify(2);
  for (std::size_t i = 0; i < one.frames.size(); ++i) {
    EXPECT_EQ(one.frames[i].doubt, two.frames[i].doubt);
    EXPECT_EQ(one.frames[i].depth_agreement, two.frames[i].depth_agreement);
  }
}

TEST(VerifyPoses, ACameraThatIsSaidToStandStillContradictsItself)
{
  VerifiedScan scan(1);
  for (const std::size_t i : scan.model.registeredFrames())
    scan.model.setWorldFromCamera(i, Pose::Identity());
  const Verification verification = scan.verify();
  EXPECT_TRUE(has(verification.findings, "contradicting_matches"));
  EXPECT_EQ(verdictOf(verification.findings), Verdict::DOUBTFUL);
}

TEST(VerifyPoses, MotionThatNoHandMakesIsAFinding)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  EXPECT_FALSE(has(VerifiedScan(1).verify().findings, "motion"));
  EXPECT_TRUE(has(VerifiedScan(1, 0.02).verify().findings, "motion"));
}

TEST(VerifyPoses, AFrameFarOffIsRefutedAndSaysNothingOfMotion)
{
  VerifiedScan scan(1);
  const std::size_t frame = scan.model.registeredFrames()[10];
  Pose far = scan.model.worldFromCamera(frame);
  far.translation().x() += 4;
  scan.model.setWorldFromCamera(frame, far);
  const Verification verification = scan.verify();
  EXPECT_EQ(verification.frames[frame].verdict, FrameVerdict::DOUBTFUL);
  for (std::size_t i = 0; i < verification.frames.size(); ++i)
    EXPECT_EQ(verification.frames[i].refuted, i == frame) << i;
  EXPECT_FALSE(has(verification.findings, "motion"));
}
