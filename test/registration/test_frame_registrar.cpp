// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/frame_registrar.h"

#include "landmarks.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Two registered frames that share no point, and a dense term between them. */
struct DensePair {
  Landmarks landmarks{50};
  std::vector<LandmarkView> views = landmarkViews(landmarks, 2);
  ImageGraph graph = toGraph(landmarks, views);
  SparseModel model{2};
  RelativePoseTerm term;

  DensePair()
  {
    for (std::size_t i = 0; i < 2; ++i)
      model.registerFrame(i, randomMotion(unsigned(5 + i), 0.8, 2), 0);
    term.first = 0;
    term.second = 1;
    term.first_from_second = model.worldFromCamera(0).inverse() * model.worldFromCamera(1);
    Matrix6d root = Matrix6d::Zero();
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j <= i; ++j)
        root(i, j) = i == j ? 4000 + 1000 * i : 200 * (i - 2 * j);
    term.information = root * root.transpose();
  }

  Matrix6d
  covarianceOf(std::size_t frame, const std::vector<RelativePoseTerm>& terms) const
  {
    const FrameRegistrationOptions options;
    const BundleAdjustmentOptions adjustment;
    const DepthViewProvider none;
    return FrameRegistrar(graph, none, options, adjustment).poseCovariance(model, frame, terms);
  }

  /** The term's error when one camera is turned about itself and moved in the world. */
  Vector6d
  errorAfter(std::size_t frame, const Vector6d& change) const
  {
    Pose poses[] = {model.worldFromCamera(0), model.worldFromCamera(1)};
    Vector6d turn = Vector6d::Zero();
    turn.head<3>() = change.head<3>();
    poses[frame].linear() = increment(turn).linear() * poses[frame].linear();
    poses[frame].translation() += change.tail<3>();
    return logarithm(poses[0].inverse() * poses[1] * term.first_from_second.inverse());
  }
};

} // namespace

TEST(PoseCovariance, IsThatOfTheDenseTermsOfEitherImage)
{
  const DensePair pair;
  for (const std::size_t frame : {0, 1}) {
    Matrix6d jacobian;
    constexpr double STEP = 1e-6;
    for (int k = 0; k < 6; ++k)
      jacobian.col(k) = (pair.errorAfter(frame, STEP * Vector6d::Unit(k)) -
                         pair.errorAfter(frame, -STEP * Vector6d::Unit(k))) /
                        (2 * STEP);
    const Matrix6d expected = (jacobian.transpose() * pair.term.information * jacobian).inverse();
    const Matrix6d covariance = pair.covarianceOf(frame, {pair.term});
    EXPECT_LT((covariance - expected).norm(), 1e-4 * expected.norm()) << frame;
    const Matrix6d of_two = pair.covarianceOf(frame, {pair.term, pair.term});
    EXPECT_LT((of_two - expected / 2).norm(), 1e-4 * expected.norm()) << frame;
  }
}
