// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/registration_by_time.h"

#include "mapping/scans.h"
#include "messages.h"

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using Images = std::vector<std::size_t>;

/** Frames of the room in which no feature is found: depth and time are all there is. */
struct Featureless {
  Scan scan;
  ImageGraph graph{room().camera()};
  SparseModel model;
  MapperOptions options;

  explicit Featureless(const std::vector<std::size_t>& frames, std::size_t empty = 1000,
                       bool has_prior = false)
  : model(frames.size())
  {
    for (const std::size_t i : frames) {
      const cv::Mat depth = room().read(i).depth;
      const bool is_empty = scan.nodes.size() == empty;
      scan.add(noFeatures(), is_empty ? cv::Mat(0 * depth) : depth, room().worldFromCamera(i));
      scan.nodes.back().timestamp = room().timestamp(i);
      if (has_prior) // some millimetres off
        scan.nodes.back().prior = PosePrior{randomMotion(1, 1, 5) * scan.truth.back() *
                                            randomMotion(unsigned(i), 0.003, 0.003)};
    }
    graph.append(scan.nodes, true);
  }

  /** The frames that were tried, in order. */
  Images
  registerFrom(std::size_t frame, int component = 0)
  {
    model.registerFrame(frame, scan.truth[frame], component);
    return tried(0);
  }

  Images
  tried(int component)
  {
    const DepthViewProvider views = scan.provider();
    const FrameRegistrar registrar(graph, views, options.registration, options.adjustment);
    Images frames;
    PriorMotions prior(graph, options);
    prior.measure(model, model.registeredFrames(component));
    for (const FrameByTime& frame :
         registerByTime(graph, registrar, options, prior, component, model)) {
      frames.push_back(frame.frame);
      reasons.push_back(frame.registration.reason);
    }
    return frames;
  }

  std::vector<std::string> reasons; ///< of the frames that were tried
};

} // namespace

TEST(RegisterByTime, GoesForwardsAndThenBackwards)
{
  Featureless frames({0, 2, 4, 6, 8});
  EXPECT_EQ(frames.registerFrom(2), (Images{3, 4, 1, 0}));
  EXPECT_EQ(frames.model.registeredFrames(0).size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    const Pose error = frames.scan.truth[i].inverse() * frames.model.worldFromCamera(i);
    EXPECT_LT(error.translation().norm(), 0.005) << i;
    EXPECT_LT(degrees(rotationAngle(error)), 0.2) << i;
  }
}

TEST(RegisterByTime, FollowsTheStampsNotTheNumbers)
{
  Featureless in_order({0, 2, 4, 6}), shuffled({4, 0, 6, 2});
  EXPECT_EQ(in_order.registerFrom(1), (Images{2, 3, 0}));
  EXPECT_EQ(shuffled.registerFrom(3), (Images{0, 2, 1}));
  const std::size_t number[] = {1, 3, 0, 2}; // of each frame in the shuffled scan
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(in_order.model.worldFromCamera(i).matrix(),
              shuffled.model.worldFromCamera(number[i]).matrix());
}

TEST(RegisterByTime, NeedsOrderAndTheMethodThatUsesGeometry)
{
  Featureless frames({0, 2});
  frames.options.schedule.ordered_in_time = false;
  EXPECT_EQ(frames.registerFrom(0), Images{});
  frames.options.schedule.ordered_in_time = true;
  for (const auto method : {FrameRegistrationMethod::VISUAL, FrameRegistrationMethod::PNP}) {
    frames.options.registration.method = method;
    EXPECT_EQ(frames.tried(0), Images{});
  }
  frames.options.registration.method = FrameRegistrationMethod::BUNDLE_ICP;
  EXPECT_EQ(frames.tried(0), Images{1});
}

TEST(RegisterByTime, ContinuesItsComponentAlone)
{
  Featureless frames({0, 2, 4});
  EXPECT_EQ(frames.registerFrom(1, 1), Images{}); // as component 0 it has no frame
  EXPECT_EQ(frames.tried(1), (Images{2, 0}));
  EXPECT_EQ(frames.model.registeredFrames(1), (Images{0, 1, 2}));
}

TEST(RegisterByTime, ThePriorLeadsAcrossFramesThatShowNothing)
{
  for (const bool has_prior : {false, true}) {
    Featureless frames({0, 2, 4, 6, 8}, 3, has_prior); // the fourth has no depth
    for (const std::size_t frame : {0, 1})
      frames.model.registerFrame(frame, frames.scan.truth[frame], 0);
    frames.registerFrom(2);
    EXPECT_FALSE(frames.model.isRegistered(3));
    EXPECT_EQ(frames.model.isRegistered(4), has_prior);
    if (!has_prior)
      continue;
    const Pose error = frames.scan.truth[4].inverse() * frames.model.worldFromCamera(4);
    EXPECT_LT(error.translation().norm(), 0.005);
    EXPECT_LT(degrees(rotationAngle(error)), 0.2);
  }
}

TEST(RegisterByTime, LeavesFramesWhoseMatchesBelongElsewhere)
{
  Scan scan;
  scan.add(noFeatures(), room().read(0).depth, room().worldFromCamera(0));
  scan.addRoom({2, 4});
  const ImageGraph graph = scan.graph();
  ASSERT_GE(graph.edges(1).front().pair->matches.size(), 100u);
  SparseModel model(3);
  model.registerFrame(0, scan.truth[0], 0);
  const MapperOptions options;
  const DepthViewProvider views = scan.provider();
  const FrameRegistrar registrar(graph, views, options.registration, options.adjustment);
  EXPECT_TRUE(registerByTime(graph, registrar, options, {graph, options}, 0, model).empty());
  model.registerFrame(1, scan.truth[1], 0); // now they belong here
  ASSERT_EQ(registerByTime(graph, registrar, options, {graph, options}, 0, model).size(), 1u);
  EXPECT_TRUE(model.isRegistered(2));
}

TEST(RegisterByTime, LeavesTexturedFramesThatMatchNothing)
{
  Scan scan;
  scan.addRoom({0, 2});
  Features others = roomFeatures(4);
  cv::flip(others.descriptors.clone(), others.descriptors, 0); // as those of another room
  scan.add(others, room().read(4).depth, room().worldFromCamera(4));
  scan.add(noFeatures(), room().read(6).depth, room().worldFromCamera(6));
  ImageGraph graph = scan.graph();
  ASSERT_TRUE(graph.edges(2).empty());
  SparseModel model(4);
  model.registerFrame(0, scan.truth[0], 0);
  model.registerFrame(1, scan.truth[1], 0);
  model.registerFrame(3, scan.truth[3], 0);
  const MapperOptions options;
  const DepthViewProvider views = scan.provider();
  const FrameRegistrar registrar(graph, views, options.registration, options.adjustment);
  EXPECT_TRUE(registerByTime(graph, registrar, options, {graph, options}, 0, model).empty());
  EXPECT_FALSE(model.isRegistered(2));
}

TEST(RegisterByTime, TriesAnImageThatFailedFromTheOtherSide)
{
  // A wall alone does not hold a frame that slides along it.
  Scan scan;
  scan.camera = smallCamera();
  for (int i = 0; i < 3; ++i)
    scan.add(noFeatures(), planeDepth(scan.camera, Eigen::Vector3d::UnitZ(), 2), Pose::Identity());
  ImageGraph graph(scan.camera);
  graph.append(scan.nodes, true);
  SparseModel model(3);
  model.registerFrame(0, Pose::Identity(), 0);
  model.registerFrame(2, Pose::Identity(), 0);
  const MapperOptions options;
  const DepthViewProvider views = scan.provider();
  const FrameRegistrar registrar(graph, views, options.registration, options.adjustment);
  const std::vector<FrameByTime> tried =
      registerByTime(graph, registrar, options, {graph, options}, 0, model);
  ASSERT_EQ(tried.size(), 2u);
  for (const FrameByTime& frame : tried) {
    EXPECT_EQ(frame.frame, 1u);
    EXPECT_FALSE(frame.registration.registered);
    EXPECT_CONTAINS(frame.registration.reason, "directions");
  }
  EXPECT_FALSE(model.isRegistered(1));
}

TEST(RegisterByTime, LeavesOutBlurredImages)
{
  const Landmarks landmarks(300);
  std::vector<LandmarkView> views = landmarkViews(landmarks, 4);
  views[2].features.sharpness = 0.01;
  const ImageGraph graph = toGraph(landmarks, views);
  ASSERT_EQ(graph.exclusion(2).rfind("blurred", 0), 0u);
  SparseModel model(4);
  for (const std::size_t i : {0, 1, 3})
    model.registerFrame(i, views[i].world_from_camera, 0);
  const MapperOptions options;
  const DepthViewProvider none; // it is not even asked
  const FrameRegistrar registrar(graph, none, options.registration, options.adjustment);
  EXPECT_TRUE(registerByTime(graph, registrar, options, {graph, options}, 0, model).empty());
}
