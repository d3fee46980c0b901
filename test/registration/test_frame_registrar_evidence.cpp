// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Single frames and pairs of frames, by matches and by depth.
#include "registration/frame_registrar.h"
#include "registration/shared_error.h"

#include "landmarks.h"
#include "made_matches.h"
#include "messages.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <stdexcept>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Views of landmarks, all but the last registered where they were taken. No depth images. */
struct LandmarkModel {
  static constexpr std::size_t NEW = 5;
  Landmarks landmarks{300};
  std::vector<LandmarkView> views = landmarkViews(landmarks, NEW + 1);
  ImageGraph graph = toGraph(landmarks, views);
  SparseModel model{NEW + 1};
  FrameRegistrationOptions options;
  BundleAdjustmentOptions adjustment;
  DepthViewProvider no_depth = [](std::size_t, const SparseModel&) -> DepthAlignment::View {
    throw std::logic_error("asked for depth");
  };

  LandmarkModel()
  {
    for (std::size_t i = 0; i < NEW; ++i)
      model.registerFrame(graph, i, views[i].world_from_camera, 0, TrackOptions());
  }

  FrameRegistrar
  registrar() const
  {
    return FrameRegistrar(graph, no_depth, options, adjustment);
  }

  FrameRegistration
  registered() const
  {
    const FrameRegistrar registrar = this->registrar();
    return registrar.registerVisually(model, registrar.newFrame(model, NEW, 0, 1));
  }

  Pose
  truth() const
  {
    return views[NEW].world_from_camera;
  }
};

/** Depth images without features, and a model that knows their poses. */
struct DepthModel {
  std::vector<DepthAlignment::View> views;
  ImageGraph graph;
  SparseModel model;
  FrameRegistrationOptions options;
  BundleAdjustmentOptions adjustment;
  DepthViewProvider provider = [this](std::size_t frame, const SparseModel&) {
    return views[frame];
  };

  DepthModel(const CameraIntrinsics& camera, const std::vector<cv::Mat>& depths,
             const std::vector<Pose>& poses)
  : graph(camera), model(depths.size())
  {
    std::vector<ImageNode> nodes;
    for (std::size_t i = 0; i < depths.size(); ++i) {
      views.push_back(std::make_shared<const DepthView>(makeDepthView(depths[i], camera)));
      nodes.push_back({noFeatures(), double(i)});
      model.registerFrame(i, poses[i], 0);
    }
    graph.append(nodes, false);
  }

  FrameRegistration
  byGeometry(const Pose& guess) const
  {
    const NewFrame frame{1, {{0, 0}}, guess, 1};
    return FrameRegistrar(graph, provider, options, adjustment).bundleICP(model, frame);
  }
};

/** Two frames of the room, the second one known up to a motion. */
DepthModel
roomPair(const Pose& displaced = Pose::Identity())
{
  return DepthModel(room().camera(), {room().readExact(3).depth, room().readExact(4).depth},
                    {room().worldFromCamera(3), room().worldFromCamera(4) * displaced});
}

double
smallestEigenvalue(const Matrix6d& matrix)
{
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(matrix).eigenvalues()[0];
}

} // namespace

TEST(FrameRegistrar, NeighboursAreThoseOfTheComponentWithMostMatchesFirst)
{
  LandmarkModel scene;
  scene.model = SparseModel(6);
  for (const std::size_t i : {0, 1, 2, 4})
    scene.model.registerFrame(i, scene.views[i].world_from_camera, i == 2 ? 1 : 0);
  const std::vector<Neighbour> neighbours =
      scene.registrar().registeredNeighbours(scene.model, LandmarkModel::NEW, 0);
  ASSERT_EQ(neighbours.size(), 3u) << "neither 3, not registered, nor 2, of another component";
  std::size_t before = 1000;
  for (const Neighbour& neighbour : neighbours) {
    EXPECT_NE(neighbour.frame, 2u);
    EXPECT_LE(neighbour.matches, before);
    EXPECT_GT(neighbour.matches, 50u);
    before = neighbour.matches;
  }
}

TEST(FrameRegistrar, WithoutVisualStartTheGuessIsThePoseOfTheBestNeighbour)
{
  LandmarkModel scene;
  NewFrame frame = scene.registrar().newFrame(scene.model, LandmarkModel::NEW, 0, 3);
  EXPECT_FALSE(frame.guess);
  EXPECT_EQ(frame.num_threads, 3);
  scene.options.visual_start = false;
  frame = scene.registrar().newFrame(scene.model, LandmarkModel::NEW, 0, 3);
  ASSERT_TRUE(frame.guess);
  EXPECT_EQ(frame.guess->matrix(),
            scene.views[frame.neighbours.front().frame].world_from_camera.matrix());
  const FrameRegistration none = scene.registrar().registerVisually(scene.model, frame);
  EXPECT_FALSE(none.registered);
  EXPECT_TRUE(none.by_geometry);
  EXPECT_EQ(none.matches, 0u) << "matches take no part";
}

TEST(FrameRegistrar, FindsThePoseFromMatchesByDistancesAndByPixels)
{
  for (const auto method : {FrameRegistrationMethod::VISUAL, FrameRegistrationMethod::PNP}) {
    LandmarkModel scene;
    scene.options.method = method;
    const FrameRegistration found = scene.registered();
    EXPECT_TRUE(found.registered) << found.reason;
    EXPECT_LT(logarithm(scene.truth().inverse() * found.world_from_camera).norm(), 1e-4);
    EXPECT_EQ(found.inliers, found.matches);
    EXPECT_GT(found.matches, 100u);
    EXPECT_FALSE(found.by_geometry);
    EXPECT_EQ(found.icp_rmse, 0) << "was not aligned";
    EXPECT_GT(found.position_deviation, 0);
    EXPECT_LT(found.position_deviation, 0.005);
    EXPECT_GT(smallestEigenvalue(found.covariance), 0);
  }
}

TEST(FrameRegistrar, MethodsWithoutDepthAskForNone)
{
  LandmarkModel scene;
  scene.options.method = FrameRegistrationMethod::VISUAL;
  const FrameRegistrar registrar = scene.registrar();
  const NewFrame frame = registrar.newFrame(scene.model, LandmarkModel::NEW, 0, 1);
  const FrameRegistration found = registrar.bundleICP(scene.model, frame);
  EXPECT_EQ(found.world_from_camera.matrix(), scene.registered().world_from_camera.matrix());
  scene.options.method = FrameRegistrationMethod::BUNDLE_ICP;
  EXPECT_EQ(messageOf<std::logic_error>([&] { scene.registrar().bundleICP(scene.model, frame); }),
            "asked for depth");
}

TEST(FrameRegistrar, FollowsTheWorldFrame)
{
  LandmarkModel scene;
  const FrameRegistration here = scene.registered();
  const Pose world = randomMotion(1, 2, 3);
  scene.model.transform(0, world);
  const FrameRegistration there = scene.registered();
  const Pose expected = world * here.world_from_camera;
  EXPECT_LT(logarithm(expected.inverse() * there.world_from_camera).norm(), 1e-4);
  EXPECT_EQ(there.inliers, here.inliers);
  const Matrix6d turn = turned(world.linear());
  EXPECT_LT(difference(there.covariance, Matrix6d(turn * here.covariance * turn.transpose())),
            0.02);
}

TEST(FrameRegistrar, RefusesAPoseOfTooFewMatchesOrOneThatTheyLeaveOpen)
{
  LandmarkModel scene;
  scene.options.min_visual_inliers = 1000;
  const FrameRegistration few = scene.registered();
  EXPECT_FALSE(few.registered);
  EXPECT_EQ(few.reason, "only " + std::to_string(few.inliers) + " of " +
                            std::to_string(few.matches) +
                            " visual correspondences agree on a pose; needed are 1000");
  scene.options = {};
  const double deviation = scene.registered().position_deviation;
  scene.options.max_position_deviation = 0.9 * deviation;
  const FrameRegistration open = scene.registered();
  EXPECT_FALSE(open.registered);
  EXPECT_EQ(open.position_deviation, deviation);
  EXPECT_CONTAINS(open.reason, "its matches and its depth leave the pose open: +- ");
  EXPECT_CONTAINS(open.reason, " degrees about, some direction");
  scene.options.max_position_deviation = 1.1 * deviation;
  EXPECT_TRUE(scene.registered().registered);
}

TEST(FrameRegistrar, PairsOfDepthImagesTellTheMotionBetweenThem)
{
  const DepthModel scene = roomPair(randomMotion(1, 0.004, 0.004));
  const Pose truth = room().worldFromCamera(3).inverse() * room().worldFromCamera(4);
  const FrameRegistrar registrar(scene.graph, scene.provider, scene.options, scene.adjustment);
  const std::optional<RelativePoseTerm> forth = registrar.registerPair(scene.model, 0, 1);
  const std::optional<RelativePoseTerm> back = registrar.registerPair(scene.model, 1, 0);
  ASSERT_TRUE(forth && back);
  EXPECT_EQ(forth->first, 0u);
  EXPECT_EQ(forth->second, 1u);
  EXPECT_LT(logarithm(truth.inverse() * forth->first_from_second).norm(), 1e-3);
  EXPECT_LT(logarithm(forth->first_from_second * back->first_from_second).norm(), 1e-3);
  EXPECT_GT(smallestEigenvalue(forth->information), 0);
}

TEST(FrameRegistrar, ErrorsThatDepthImagesShareLimitTheWeightOfPairs)
{
  DepthModel scene = roomPair();
  const auto information = [&](bool depth_errors) {
    FrameRegistrar registrar(scene.graph, scene.provider, scene.options, scene.adjustment);
    registrar.setDepthErrors(depth_errors);
    return registrar.registerPair(scene.model, 0, 1)->information;
  };
  const Matrix6d usual = information(true), alone = information(false);
  EXPECT_GT(smallestEigenvalue(alone - usual), 0) << "of independent noise alone";
  scene.options.shared_depth_sigmas = 8;
  EXPECT_GT(smallestEigenvalue(usual - information(true)), 0);

  // In the limit nothing but the errors that each of the two frames shares is left.
  scene.options.shared_depth_sigmas = 1000;
  const cv::Mat& depth = scene.views[1]->depth;
  const double z = cv::mean(depth, cv::Mat(depth == depth))[0];
  const SharedError shared(z, room().camera().depth_noise, 1000);
  EXPECT_NEAR(information(true)(3, 3) * 2 * shared.shift * shared.shift, 1, 0.01);
  EXPECT_NEAR(information(true)(0, 0) * 2 * shared.tilt * shared.tilt, 1, 0.01);
}

TEST(FrameRegistrar, PairsWhoseSurfacesDoNotMeetTellNothing)
{
  Vector6d about = Vector6d::Zero();
  about[1] = M_PI;
  const DepthModel scene = roomPair(increment(about));
  const FrameRegistrar registrar(scene.graph, scene.provider, scene.options, scene.adjustment);
  EXPECT_FALSE(registrar.registerPair(scene.model, 0, 1));
}

TEST(FrameRegistrar, GeometryAloneFindsANearPoseAndRefusesOthersSayingWhy)
{
  const DepthModel scene = roomPair();
  const Pose truth = room().worldFromCamera(4);
  const FrameRegistration found = scene.byGeometry(truth * randomMotion(2, 0.03, 0.03));
  EXPECT_TRUE(found.registered) << found.reason;
  EXPECT_TRUE(found.by_geometry);
  EXPECT_EQ(found.matches, 0u);
  EXPECT_LT(logarithm(truth.inverse() * found.world_from_camera).norm(), 3e-3);

  Vector6d about = Vector6d::Zero();
  about[1] = M_PI;
  const FrameRegistration off = scene.byGeometry(truth * increment(about));
  EXPECT_FALSE(off.registered);
  EXPECT_EQ(off.reason, "geometry alone did not converge");
}

TEST(FrameRegistrar, GeometryOfAPlaneLeavesDirectionsOpen)
{
  const CameraIntrinsics camera = smallCamera();
  const cv::Mat plane = planeDepth(camera, {0, 0, 1}, 1.5);
  DepthModel scene(camera, {plane, plane}, {Pose::Identity(), Pose::Identity()});
  const FrameRegistration registration = scene.byGeometry(Pose::Identity());
  EXPECT_FALSE(registration.registered);
  EXPECT_EQ(registration.reason, "geometry alone leaves 3 directions of motion open");
}

TEST(FrameRegistrar, GeometryMustSeeEnoughOfTheModel)
{
  DepthModel scene = roomPair();
  scene.options.min_overlap = 1;
  const FrameRegistration registration = scene.byGeometry(room().worldFromCamera(4));
  EXPECT_FALSE(registration.registered);
  EXPECT_CONTAINS(registration.reason, "geometry alone: only ");
  EXPECT_CONTAINS(registration.reason, " % of the depth lies on the model");
}
