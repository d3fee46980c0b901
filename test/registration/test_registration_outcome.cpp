// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What registration says of itself: status, summary, and the faults of its options.
#include <bundle_icp/registration/frame_registration.h>
#include <bundle_icp/registration/impl/point_alignment.h>

#include <gtest/gtest.h>

#include <cmath>
#include <set>

using namespace bundle_icp;

namespace {

constexpr BundleICPStatus ALL_STATUSES[] = {BundleICPStatus::NOT_RUN,
                                            BundleICPStatus::CONVERGED,
                                            BundleICPStatus::MAX_ITERATIONS,
                                            BundleICPStatus::TOO_FEW_CORRESPONDENCES,
                                            BundleICPStatus::NO_OVERLAP,
                                            BundleICPStatus::LOW_OVERLAP,
                                            BundleICPStatus::REFINEMENT_REJECTED,
                                            BundleICPStatus::INVALID_INPUT};

} // namespace

TEST(BundleICPStatus, HasANameOfItsOwnAndTwoMeanThatTheCloudsMeet)
{
  std::set<std::string> names;
  for (const BundleICPStatus status : ALL_STATUSES) {
    const std::string name = toString(status);
    EXPECT_FALSE(name.empty());
    names.insert(name);
    EXPECT_EQ(hasConverged(status), name == "CONVERGED" || name == "MAX_ITERATIONS") << name;
  }
  EXPECT_EQ(names.size(), std::size(ALL_STATUSES));
  EXPECT_EQ(toString(static_cast<BundleICPStatus>(99)), std::string());
}

TEST(BundleICPResult, SummaryNamesMetresOnlyWhereLengthsAreMetres)
{
  BundleICPResult result;
  EXPECT_EQ(result.summary(), "NOT_RUN: 0 inliers, overlap 0, distance 0, 0 iterations");
  result.status = BundleICPStatus::NO_OVERLAP;
  result.inliers = 123;
  result.overlap = 0.25;
  result.rmse = 0.5;
  result.iterations = 17;
  EXPECT_EQ(result.summary(), "NO_OVERLAP: 123 inliers, overlap 0.25, distance 0.5, 17 iterations");
  result.projective = true;
  EXPECT_EQ(result.summary(),
            "NO_OVERLAP: 123 inliers, overlap 0.25, distance 0.5 m, 17 iterations");
}

TEST(BundleICPResult, CovarianceIsTheInverseAndInfiniteAlongOpenDirections)
{
  BundleICPResult result;
  for (int k = 0; k < 6; ++k)
    EXPECT_TRUE(std::isinf(result.covariance()(k, k))) << "nothing was measured";

  Matrix6d root = Matrix6d::Identity();
  root(0, 4) = 3;
  root(2, 3) = -2;
  result.information = root.transpose() * root;
  EXPECT_LT((result.covariance() * result.information - Matrix6d::Identity()).norm(), 1e-12);

  // Open along the first axis of translation, and along a second one that slants
  const Vector6d slanting = (Vector6d::Unit(1) - Vector6d::Unit(4)).normalized();
  result.degenerate_directions = {Vector6d::Unit(3), slanting};
  Matrix6d held = Matrix6d::Identity();
  for (const Vector6d& direction : result.degenerate_directions)
    held -= direction * direction.transpose();
  result.information = 4 * held;
  const Matrix6d covariance = result.covariance();
  for (const int open : {1, 3, 4})
    EXPECT_EQ(covariance(open, open), INFINITY) << open;
  for (const int closed : {0, 2, 5})
    EXPECT_NEAR(covariance(closed, closed), 0.25, 1e-12) << closed;
  EXPECT_EQ(covariance(1, 4), -INFINITY) << "they move against each other";
  EXPECT_NEAR(covariance(1, 3), 0, 1e-12) << "nothing links them";
}

TEST(FrameRegistrationOptions, NameTheFirstFault)
{
  using Options = FrameRegistrationOptions;
  const auto expectFault = [](const std::string& fault, const auto& change) {
    Options options;
    change(options);
    std::string error;
    EXPECT_FALSE(options.isValid(&error));
    EXPECT_EQ(error, fault);
    EXPECT_FALSE(options.isValid()) << "also for who does not ask";
  };
  const double nan = std::nan("");
  expectFault("min_visual_inliers must be >= 3", [](Options& o) { o.min_visual_inliers = 2; });
  expectFault("max_views must be >= 1", [](Options& o) { o.max_views = 0; });
  for (const double overlap : {0.0, -0.1, 1.1, nan})
    expectFault("min_overlap must lie in (0, 1]", [&](Options& o) { o.min_overlap = overlap; });
  for (const auto method : {FrameRegistrationMethod::VISUAL, FrameRegistrationMethod::PNP})
    expectFault("only the method BUNDLE_ICP can do without visual_start", [&](Options& o) {
      o.method = method;
      o.visual_start = false;
    });
  for (const double value : {0.0, -1.0, nan}) {
    const std::string deviations = "max_position_deviation and max_rotation_deviation must be > 0";
    expectFault(deviations, [&](Options& o) { o.max_position_deviation = value; });
    expectFault(deviations, [&](Options& o) { o.max_rotation_deviation = value; });
    expectFault("shared_depth_sigmas must be > 0",
                [&](Options& o) { o.shared_depth_sigmas = value; });
  }
}

TEST(FrameRegistrationOptions, PassOnTheFaultOfTheVirtualDepthAndKeepSilentWithoutOne)
{
  FrameRegistrationOptions options;
  options.virtual_depth.merge_sigmas = -1;
  std::string expected, error;
  ASSERT_FALSE(options.virtual_depth.isValid(&expected));
  EXPECT_FALSE(options.isValid(&error));
  EXPECT_EQ(error, expected);

  error = "untouched";
  EXPECT_TRUE(FrameRegistrationOptions().isValid(&error));
  EXPECT_EQ(error, "untouched");
  options = {};
  options.visual_start = false;
  EXPECT_TRUE(options.isValid());
}
