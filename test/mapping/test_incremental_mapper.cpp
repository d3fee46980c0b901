// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/scans.h"
#include "messages.h"

#include <pcl/exceptions.h>

#include <limits>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** A scan of the room in 15 frames. */
const Scan&
roomScan()
{
  static const Scan scan = [] {
    Scan s;
    for (std::size_t i = 0; i < 60; i += 4)
      s.addRoom({i});
    return s;
  }();
  return scan;
}

const ImageGraph&
roomGraph()
{
  static const ImageGraph graph = roomScan().graph();
  return graph;
}

/** Keeps the last state, as a file would. */
struct MapInMemory : MapStore {
  std::optional<std::string>
  load() override
  {
    return state;
  }

  void
  save(const std::string& new_state) override
  {
    state = new_state;
    all.push_back(new_state);
  }

  std::optional<std::string> state;
  std::vector<std::string> all;
};

/** The poses, points and outcomes of a run that begins with what `store` has. */
void
expectSameResult(const SparseModel& expected, const std::vector<FrameRegistration>& registrations,
                 MapInMemory store, std::size_t num_steps = 1000)
{
  IncrementalMapper mapper(roomGraph(), roomScan().provider());
  SparseModel model;
  std::size_t steps = 0;
  EXPECT_TRUE(mapper.run(
      model, [&](const Progress&) { return ++steps <= num_steps; }, &store));
  for (std::size_t i = 0; i < roomScan().nodes.size(); ++i) {
    EXPECT_EQ(model.worldFromCamera(i).matrix(), expected.worldFromCamera(i).matrix());
    EXPECT_EQ(model.depthError(i), expected.depthError(i));
    EXPECT_EQ(mapper.registrations()[i].covariance, registrations[i].covariance);
    EXPECT_EQ(mapper.registrations()[i].inliers, registrations[i].inliers);
  }
  EXPECT_EQ(model.calibration().values, expected.calibration().values);
  ASSERT_EQ(model.points().size(), expected.points().size());
  for (std::size_t p = 0; p < model.points().size(); ++p)
    ASSERT_EQ(model.points()[p].position, expected.points()[p].position);
}

} // namespace

TEST(IncrementalMapper, RegistersAScanWhereItWasTaken)
{
  IncrementalMapper mapper(roomGraph(), roomScan().provider());
  SparseModel model;
  EXPECT_TRUE(mapper.run(model));
  ASSERT_EQ(model.registeredFrames(0).size(), roomScan().nodes.size());
  const PoseErrors errors = largestErrors(model, roomScan().truth, 0);
  EXPECT_LT(errors.distance, 0.001);
  EXPECT_LT(errors.angle, 0.05);
  ASSERT_EQ(mapper.registrations().size(), roomScan().nodes.size());
  for (const FrameRegistration& registration : mapper.registrations()) {
    EXPECT_TRUE(registration.registered);
    EXPECT_FALSE(registration.by_geometry);
    EXPECT_EQ(registration.reason, "");
    EXPECT_GE(registration.inliers, FrameRegistrationOptions().min_visual_inliers);
    EXPECT_LE(registration.inliers, registration.matches);
  }
}

TEST(IncrementalMapper, EveryMethodRegistersAScanWhereItWasTaken)
{
  MapperOptions visual, pnp, without_visual_start, without_global_adjustment;
  visual.registration.method = FrameRegistrationMethod::VISUAL;
  pnp.registration.method = FrameRegistrationMethod::PNP;
  pnp.refinement.num_dense_neighbours = 0;
  without_visual_start.registration.visual_start = false;
  without_global_adjustment.schedule.global_adjustment = false;
  for (const MapperOptions& options :
       {visual, pnp, without_visual_start, without_global_adjustment}) {
    IncrementalMapper mapper(roomGraph(), roomScan().provider(), options);
    SparseModel model;
    EXPECT_TRUE(mapper.run(model));
    EXPECT_EQ(model.registeredFrames(0).size(), roomScan().nodes.size());
    EXPECT_LT(largestErrors(model, roomScan().truth, 0).distance, 0.003);
    for (const FrameRegistration& registration : mapper.registrations())
      EXPECT_EQ(registration.by_geometry, !options.registration.visual_start)
          << registration.reason;
  }
}

TEST(IncrementalMapper, DoesNotDependOnThreads)
{
  SparseModel models[2];
  for (const int threads : {1, 2}) {
    MapperOptions options;
    options.num_threads = threads;
    EXPECT_TRUE(
        IncrementalMapper(roomGraph(), roomScan().provider(), options).run(models[threads - 1]));
  }
  for (std::size_t i = 0; i < roomScan().nodes.size(); ++i)
    EXPECT_EQ(models[0].worldFromCamera(i).matrix(), models[1].worldFromCamera(i).matrix());
  ASSERT_EQ(models[0].points().size(), models[1].points().size());
  for (std::size_t p = 0; p < models[0].points().size(); ++p)
    ASSERT_EQ(models[0].points()[p].position, models[1].points()[p].position);
}

TEST(IncrementalMapper, StopsWhenAsked)
{
  IncrementalMapper mapper(roomGraph(), roomScan().provider());
  SparseModel model;
  const auto stop_soon = [](const Progress& progress) {
    EXPECT_EQ(progress.stage, "registration");
    EXPECT_EQ(progress.total, 15u);
    return progress.done < 4;
  };
  EXPECT_FALSE(mapper.run(model, stop_soon));
  EXPECT_GE(model.registeredFrames().size(), 4u);
  EXPECT_LT(model.registeredFrames().size(), 15u);
}

TEST(IncrementalMapper, GoesOnFromAnyStateToTheSameResult)
{
  SparseModel expected;
  IncrementalMapper whole(roomGraph(), roomScan().provider());
  std::size_t steps = 0;
  MapInMemory states;
  EXPECT_TRUE(whole.run(
      expected, [&](const Progress&) { return ++steps > 0; }, &states));
  // Each stage of the component ends with a save.
  ASSERT_GE(states.all.size(), 6u);
  for (const std::string& state : states.all) {
    MapInMemory store;
    store.state = state;
    expectSameResult(expected, whole.registrations(), store);
  }
  // The state at the end leaves nothing to do.
  expectSameResult(expected, whole.registrations(), states, 0);
  // Stopped between two frames.
  for (std::size_t last = 0; last < steps; last += 2) {
    MapInMemory store;
    SparseModel model;
    std::size_t step = 0;
    EXPECT_FALSE(IncrementalMapper(roomGraph(), roomScan().provider())
                     .run(
                         model, [&](const Progress&) { return step++ < last; }, &store));
    expectSameResult(expected, whole.registrations(), store, steps - last - 1);
  }
}

TEST(IncrementalMapper, GoesOnFromAJointToTheSameResult)
{
  Scan scan;
  scan.addRoom({0, 2, 4});
  scan.add(noFeatures(), room().read(6).depth, room().worldFromCamera(6));
  scan.addRoom({8});
  const ImageGraph graph = scan.graph();
  MapperOptions options;
  options.schedule.ordered_in_time = false; // else time registers the frame
  IncrementalMapper whole(graph, scan.provider(), options);
  SparseModel expected;
  MapInMemory states;
  EXPECT_TRUE(whole.run(expected, {}, &states));
  ASSERT_EQ(whole.joints().size(), 1u);
  EXPECT_EQ(expected.registeredFrames(0).size(), scan.nodes.size());
  EXPECT_LT(largestErrors(expected, scan.truth, 0).distance, 0.003);
  for (const std::string& state : states.all) {
    MapInMemory store;
    store.state = state;
    IncrementalMapper mapper(graph, scan.provider(), options);
    SparseModel model;
    EXPECT_TRUE(mapper.run(model, {}, &store));
    ASSERT_EQ(mapper.joints().size(), 1u);
    EXPECT_EQ(mapper.joints()[0].support, whole.joints()[0].support);
    for (std::size_t i = 0; i < scan.nodes.size(); ++i)
      EXPECT_EQ(model.worldFromCamera(i).matrix(), expected.worldFromCamera(i).matrix());
  }
}

TEST(IncrementalMapper, ScansWithNothingInCommonAreComponents)
{
  SyntheticScanOptions options;
  options.width = 320;
  options.height = 240;
  options.focal_length = 262.5;
  options.seed = 5; // other textures
  const SyntheticScan other(options);
  Scan scan; // of two rooms of one shape
  scan.addRoom({0, 1, 2});
  for (const std::size_t i : {30, 34, 38, 42})
    scan.add(extractFeatures(other.read(i), other.camera()), other.read(i).depth,
             other.worldFromCamera(i));
  const ImageGraph graph = scan.graph();
  MapperOptions mapping;
  mapping.schedule.ordered_in_time = false;
  SparseModel model;
  EXPECT_TRUE(IncrementalMapper(graph, scan.provider(), mapping).run(model));
  EXPECT_EQ(model.registeredFrames(0), (std::vector<std::size_t>{3, 4, 5, 6}));
  EXPECT_EQ(model.registeredFrames(1), (std::vector<std::size_t>{0, 1, 2}));
  for (const int component : {0, 1})
    EXPECT_LT(largestErrors(model, scan.truth, component).distance, 0.002);
}

TEST(IncrementalMapper, GeometryRegistersAnImageWithoutFeatures)
{
  Scan scan;
  scan.addRoom({0, 2, 4});
  scan.add(noFeatures(), room().read(6).depth, room().worldFromCamera(6));
  scan.addRoom({8});
  const ImageGraph graph = scan.graph();
  IncrementalMapper mapper(graph, scan.provider());
  SparseModel model;
  EXPECT_TRUE(mapper.run(model));
  ASSERT_TRUE(model.isRegistered(3)) << mapper.registrations()[3].reason;
  EXPECT_TRUE(mapper.registrations()[3].by_geometry);
  EXPECT_FALSE(mapper.registrations()[2].by_geometry);
  EXPECT_LT(largestErrors(model, scan.truth, 0).distance, 0.003);

  MapperOptions visual; // virtual depth alone carries it
  visual.registration.method = FrameRegistrationMethod::VISUAL;
  SparseModel without;
  EXPECT_TRUE(IncrementalMapper(graph, scan.provider(), visual).run(without));
  EXPECT_FALSE(without.isRegistered(3));

  MapperOptions options; // without time there is nothing to start from
  options.schedule.ordered_in_time = false;
  options.refinement.join_by_geometry = false;
  IncrementalMapper unordered(graph, scan.provider(), options);
  SparseModel other;
  EXPECT_TRUE(unordered.run(other));
  EXPECT_FALSE(other.isRegistered(3));
  EXPECT_CONTAINS(unordered.registrations()[3].reason, "no other image shares");
}

TEST(IncrementalMapper, GeometryRefusesAnImageOfASinglePlane)
{
  const Landmarks landmarks(300, 0, 0); // a wall
  Scan scan;
  scan.camera = landmarks.camera();
  for (unsigned i = 0; i < 5; ++i) {
    const Pose pose = randomMotion(i, 0.03, 0.05 * i);
    const Eigen::Vector3d normal = pose.linear().transpose() * Eigen::Vector3d::UnitZ();
    const Features features = i == 3 ? noFeatures() : landmarks.look(pose).features;
    scan.add(features, planeDepth(scan.camera, normal, 2.25 - pose.translation().z()), pose);
  }
  const ImageGraph graph = scan.graph();
  IncrementalMapper mapper(graph, scan.provider());
  SparseModel model;
  EXPECT_TRUE(mapper.run(model));
  EXPECT_EQ(model.registeredFrames(0), (std::vector<std::size_t>{0, 1, 2, 4}));
  EXPECT_LT(largestErrors(model, scan.truth, 0).distance, 0.002);
  EXPECT_FALSE(mapper.registrations()[3].registered);
  EXPECT_CONTAINS(mapper.registrations()[3].reason, "directions");
}

TEST(IncrementalMapper, TheLargestComponentIsNumberZero)
{
  // Three frames of a rich wall, which correlate more, and five of a poor one.
  const Landmarks rich(400, 1, 0), poor(90, 2, 0);
  Scan scan;
  scan.camera = rich.camera();
  for (unsigned i = 0; i < 8; ++i) {
    const Pose pose = randomMotion(i, 0.03, 0.1);
    const Eigen::Vector3d normal = pose.linear().transpose() * Eigen::Vector3d::UnitZ();
    scan.add((i < 3 ? rich : poor).look(pose).features,
             planeDepth(scan.camera, normal, 2.25 - pose.translation().z()), pose);
  }
  const ImageGraph graph = scan.graph();
  ASSERT_GT(graph.correspondences(0), graph.correspondences(3));
  MapperOptions options;
  options.schedule.ordered_in_time = false;
  SparseModel model;
  EXPECT_TRUE(IncrementalMapper(graph, scan.provider(), options).run(model));
  EXPECT_EQ(model.registeredFrames(0), (std::vector<std::size_t>{3, 4, 5, 6, 7}));
  EXPECT_EQ(model.registeredFrames(1), (std::vector<std::size_t>{0, 1, 2}));
  for (const int component : {0, 1})
    EXPECT_LT(largestErrors(model, scan.truth, component).distance, 0.002);
}

TEST(IncrementalMapper, NothingInCommonRegistersNothing)
{
  const Landmarks a(100, 1), b(100, 2);
  Scan scan;
  scan.camera = a.camera();
  for (const Landmarks* landmarks : {&a, &b}) {
    const LandmarkView view = landmarks->look(Pose::Identity());
    scan.add(view.features, planeDepth(scan.camera, Eigen::Vector3d::UnitZ(), 2), Pose::Identity());
  }
  const ImageGraph graph = scan.graph();
  IncrementalMapper mapper(graph, scan.provider());
  SparseModel model;
  EXPECT_TRUE(mapper.run(model));
  EXPECT_TRUE(model.registeredFrames().empty());
  for (const FrameRegistration& registration : mapper.registrations())
    EXPECT_CONTAINS(registration.reason, "no other image shares");
}

TEST(IncrementalMapper, RunsOnce)
{
  const ImageGraph graph(roomScan().camera);
  IncrementalMapper mapper(graph, roomScan().provider());
  SparseModel model;
  EXPECT_TRUE(mapper.run(model));
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] { mapper.run(model); }),
                  "run() was called before");
}

TEST(IncrementalMapper, RefusesFramesWithoutADepthView)
{
  const auto none = [](std::size_t, const SparseModel&) { return std::shared_ptr<DepthView>(); };
  IncrementalMapper mapper(roomGraph(), none);
  SparseModel model;
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] { mapper.run(model); }),
                  "no depth view of frame");
  EXPECT_CONTAINS(
      messageOf<pcl::BadArgumentException>([] { IncrementalMapper(roomGraph(), nullptr); }),
      "no provider of depth views");
}

TEST(IncrementalMapper, RefusesInvalidOptions)
{
  const auto message = [](const MapperOptions& options) {
    return messageOf<pcl::BadArgumentException>(
        [&] { IncrementalMapper(roomGraph(), roomScan().provider(), options); });
  };
  MapperOptions options;
  options.registration.min_visual_inliers = 2;
  EXPECT_CONTAINS(message(options), "IncrementalMapper: min_visual_inliers must be >= 3");
  options = {};
  options.schedule.batch_size = 0;
  EXPECT_CONTAINS(message(options), "batch_size must be >= 1");
  options = {};
  options.schedule.adjustment_growth = 1;
  EXPECT_CONTAINS(message(options), "adjustment_growth must be > 1");
  options = {};
  options.registration.min_overlap = 0;
  EXPECT_CONTAINS(message(options), "min_overlap must lie in (0, 1]");
  options = {};
  options.registration.method = FrameRegistrationMethod::PNP;
  options.registration.visual_start = false;
  EXPECT_CONTAINS(message(options), "only the method BUNDLE_ICP can do without");
  options = {};
  options.num_threads = -1;
  EXPECT_CONTAINS(message(options), "num_threads must be >= 0");
  options = {};
  options.tracks.max_sigmas = 0;
  EXPECT_CONTAINS(message(options), "max_sigmas");
  options = {};
  options.adjustment.loss_scale = 0;
  EXPECT_CONTAINS(message(options), "loss_scale");
  for (const double sigmas : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    options = {};
    options.registration.shared_depth_sigmas = sigmas;
    EXPECT_CONTAINS(message(options), "shared_depth_sigmas must be > 0");
  }
  options = {};
  options.refinement.calibration_test.significance = 0;
  EXPECT_CONTAINS(message(options), "significance must be > 0");
  options = {};
  options.refinement.calibration[CalibrationParameter::FOCAL_X] = 0.5;
  EXPECT_CONTAINS(message(options), "focal_x must lie within");
}
