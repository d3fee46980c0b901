// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/model/sparse_model.h>

#include "landmarks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

std::size_t
numPoints(const SparseModel& model)
{
  std::size_t count = 0;
  for (const ScenePoint& point : model.points())
    count += !point.track.empty();
  return count;
}

/** What always holds of tracks. */
void
expectSoundTracks(const ImageGraph& graph, const SparseModel& model)
{
  std::size_t observations = 0;
  for (std::size_t p = 0; p < model.points().size(); ++p) {
    const std::vector<Observation>& track = model.points()[p].track;
    EXPECT_NE(track.size(), 1u);
    std::set<std::size_t> frames;
    for (const Observation& o : track) {
      EXPECT_TRUE(frames.insert(o.frame).second) << "twice the same image";
      EXPECT_EQ(model.pointOf(o.frame, o.feature), int(p));
      EXPECT_EQ(model.component(o.frame), model.component(track.front().frame));
    }
    observations += track.size();
  }
  std::size_t features = 0;
  for (std::size_t i = 0; i < graph.size(); ++i)
    for (std::size_t j = 0; j < graph.features(i).size(); ++j)
      features += model.pointOf(i, int(j)) >= 0;
  EXPECT_EQ(features, observations);
}

struct Scene {
  Landmarks landmarks{150};
  std::vector<LandmarkView> views = landmarkViews(landmarks, 4);
  ImageGraph graph = toGraph(landmarks, views);
  SparseModel model{4};

  void
  registerFrames(const std::vector<std::size_t>& frames, int component = 0)
  {
    for (const std::size_t i : frames)
      model.registerFrame(graph, i, views[i].world_from_camera, component, {});
  }

  /** How many of the frames show each landmark. */
  std::vector<int>
  counts(const std::vector<std::size_t>& frames) const
  {
    std::vector<int> result(150, 0);
    for (const std::size_t i : frames)
      for (const int landmark : views[i].landmarks)
        ++result[landmark];
    return result;
  }
};

} // namespace

TEST(SparseModel, TracksJoinTheFeaturesOfOnePoint)
{
  Scene scene;
  scene.registerFrames({2, 0, 3, 1});
  expectSoundTracks(scene.graph, scene.model);
  const std::vector<int> counts = scene.counts({0, 1, 2, 3});
  EXPECT_EQ(numPoints(scene.model),
            std::count_if(counts.begin(), counts.end(), [](int n) { return n > 1; }));
  for (const ScenePoint& point : scene.model.points()) {
    ASSERT_FALSE(point.track.empty());
    std::set<int> landmarks;
    for (const Observation& o : point.track)
      landmarks.insert(scene.views[o.frame].landmarks[o.feature]);
    ASSERT_EQ(landmarks.size(), 1u);
    EXPECT_EQ(point.track.size(), counts[*landmarks.begin()]);
    EXPECT_LT((point.position - scene.landmarks.point(*landmarks.begin())).norm(), 1e-5);
  }
}

TEST(SparseModel, TracksAreSoundOnRealMatches)
{
  std::vector<ImageNode> nodes;
  for (std::size_t i = 0; i < 8; ++i)
    nodes.push_back({roomFeatures(4 * i), room().timestamp(4 * i)});
  ImageGraph graph(room().camera());
  graph.append(std::move(nodes), true);
  SparseModel model(graph.size());
  for (std::size_t i = 0; i < graph.size(); ++i)
    model.registerFrame(graph, i, room().worldFromCamera(4 * i), 0, {});
  EXPECT_GT(numPoints(model), 100u);
  expectSoundTracks(graph, model);
  const std::size_t before = numPoints(model);
  for (std::size_t i = 0; i < graph.size(); ++i)
    model.extendTracks(graph, i, {});
  expectSoundTracks(graph, model);
  EXPECT_LE(numPoints(model), before + before / 10);
  model.removeOutliers(graph, {});
  expectSoundTracks(graph, model);
}

TEST(SparseModel, TracksMergeWhenALoopCloses)
{
  // Two appearances of every landmark, and a frame that recognises both.
  const Landmarks landmarks(120), others(120, 9);
  std::vector<LandmarkView> views = landmarkViews(landmarks, 5);
  for (const std::size_t i : {2, 3, 4})
    for (std::size_t j = 0; j < views[i].landmarks.size(); ++j) {
      const int landmark = views[i].landmarks[j];
      cv::Mat row = views[i].features.descriptors.row(int(j));
      const cv::Mat other = others.descriptors().row(landmark);
      if (i < 4)
        other.copyTo(row);
      else // unit length again
        cv::Mat(1.105 * (0.5 * landmarks.descriptors().row(landmark) + 0.5 * other)).copyTo(row);
    }
  const ImageGraph graph = toGraph(landmarks, views);
  ASSERT_EQ(graph.edges(4).size(), 4u);
  ASSERT_EQ(graph.numEdges(), 6u);
  SparseModel model(5);
  for (std::size_t i = 0; i < 4; ++i)
    model.registerFrame(graph, i, views[i].world_from_camera, 0, {});
  const std::size_t before = numPoints(model);
  model.registerFrame(graph, 4, views[4].world_from_camera, 0, {});
  expectSoundTracks(graph, model);
  EXPECT_LT(numPoints(model), before);
  std::size_t whole = 0;
  for (const ScenePoint& point : model.points())
    whole += point.track.size() == 5;
  EXPECT_GT(whole, 20u);
}

TEST(SparseModel, ATrackIsNotStartedByWhatDisagrees)
{
  Scene scene;
  scene.model.registerFrame(scene.graph, 0, scene.views[0].world_from_camera, 0, {});
  scene.model.registerFrame(scene.graph, 1,
                            randomMotion(0, 0.1, 0.3) * scene.views[1].world_from_camera, 0, {});
  EXPECT_LT(numPoints(scene.model), 5u);
}

TEST(SparseModel, VisibilityCountsFeaturesThatMatchPoints)
{
  Scene scene;
  EXPECT_EQ(scene.model.visibility(scene.graph, 2, 0), 0u);
  scene.registerFrames({0});
  EXPECT_EQ(scene.model.visibility(scene.graph, 2, 0), 0u); // no point yet
  scene.registerFrames({1});
  const std::vector<int> counts = scene.counts({0, 1});
  std::size_t expected = 0;
  for (const int landmark : scene.views[2].landmarks)
    expected += counts[landmark] == 2;
  EXPECT_GT(expected, 20u);
  EXPECT_EQ(scene.model.visibility(scene.graph, 2, 0), expected);
  EXPECT_EQ(scene.model.visibility(scene.graph, 2, 1), 0u); // another component
}

TEST(SparseModel, ComponentsDoNotShareTracks)
{
  Scene scene;
  scene.registerFrames({0, 1}, 0);
  scene.registerFrames({2, 3}, 1);
  expectSoundTracks(scene.graph, scene.model);
  EXPECT_EQ(scene.model.registeredFrames(0), (std::vector<std::size_t>{0, 1}));
  EXPECT_EQ(scene.model.registeredFrames(1), (std::vector<std::size_t>{2, 3}));
  EXPECT_EQ(scene.model.registeredFrames().size(), 4u);
}

TEST(SparseModel, AnImageWithoutTracksHasNoPoints)
{
  Scene scene;
  scene.registerFrames({0, 1});
  const std::size_t before = numPoints(scene.model);
  scene.model.registerFrame(2, scene.views[2].world_from_camera, 0);
  EXPECT_TRUE(scene.model.isRegistered(2));
  EXPECT_EQ(scene.model.pointOf(2, 0), -1);
  scene.registerFrames({3});
  expectSoundTracks(scene.graph, scene.model);
  EXPECT_GE(numPoints(scene.model), before);
}

TEST(SparseModel, RemovesObservationsOfAMisplacedImage)
{
  Scene scene;
  scene.registerFrames({0, 1, 2, 3});
  EXPECT_EQ(scene.model.removeOutliers(scene.graph, {}), 0u);
  scene.model.setWorldFromCamera(2, randomMotion(5, 0, 0.3) * scene.views[2].world_from_camera);
  EXPECT_GT(scene.model.removeOutliers(scene.graph, {}), 20u);
  expectSoundTracks(scene.graph, scene.model);
  for (const ScenePoint& point : scene.model.points())
    for (const Observation& o : point.track)
      EXPECT_NE(o.frame, 2u);
  std::vector<int> counts = scene.counts({0, 1, 3});
  EXPECT_EQ(numPoints(scene.model),
            std::count_if(counts.begin(), counts.end(), [](int n) { return n > 1; }));
}

TEST(SparseModel, RemovesAMisplacedPoint)
{
  Scene scene;
  scene.registerFrames({0, 1, 2, 3});
  const std::size_t before = numPoints(scene.model);
  const std::size_t track = scene.model.points()[7].track.size();
  scene.model.setPosition(7, scene.model.points()[7].position + Eigen::Vector3d(0.2, 0.2, 0));
  EXPECT_EQ(scene.model.removeOutliers(scene.graph, {}), track);
  EXPECT_TRUE(scene.model.points()[7].track.empty());
  EXPECT_EQ(numPoints(scene.model), before - 1);
}

TEST(SparseModel, TransformMovesAComponentAsOne)
{
  Scene scene;
  scene.registerFrames({0, 1}, 0);
  scene.registerFrames({2, 3}, 1);
  const SparseModel before = scene.model;
  const Pose motion = randomMotion(8, 1, 5);
  scene.model.transform(0, motion);
  for (std::size_t i = 0; i < 4; ++i) {
    const Pose expected = i < 2 ? motion * before.worldFromCamera(i) : before.worldFromCamera(i);
    EXPECT_LT((scene.model.worldFromCamera(i).matrix() - expected.matrix()).norm(), 1e-12);
  }
  for (std::size_t p = 0; p < before.points().size(); ++p) {
    const ScenePoint &was = before.points()[p], &is = scene.model.points()[p];
    const bool moved = before.component(was.track.front().frame) == 0;
    EXPECT_LT((is.position - (moved ? motion * was.position : was.position)).norm(), 1e-12);
    for (const Observation& o : is.track)
      EXPECT_TRUE(agrees(scene.graph, scene.model, o, is.position, {}));
  }
  EXPECT_EQ(scene.model.removeOutliers(scene.graph, {}), 0u);
}

TEST(SparseModel, MeasuredPointsAreTheLandmarks)
{
  Scene scene;
  scene.registerFrames({1});
  for (std::size_t j = 0; j < scene.views[1].landmarks.size(); ++j) {
    const Eigen::Vector3d& truth = scene.landmarks.point(scene.views[1].landmarks[j]);
    const Observation o{1, int(j)};
    EXPECT_LT((measuredPoint(scene.graph, scene.model, o) - truth).norm(), 1e-5);
    EXPECT_TRUE(agrees(scene.graph, scene.model, o, truth, {}));
    // Behind the camera, beside the pixel, off in depth
    const Pose& pose = scene.views[1].world_from_camera;
    const Eigen::Vector3d in_camera = pose.inverse() * truth;
    EXPECT_FALSE(agrees(scene.graph, scene.model, o, pose * (-in_camera), {}));
    EXPECT_FALSE(agrees(scene.graph, scene.model, o, pose * (1.1 * in_camera), {}));
    EXPECT_FALSE(
        agrees(scene.graph, scene.model, o, pose * (in_camera + Eigen::Vector3d(0.1, 0, 0)), {}));
  }
}

TEST(SparseModel, ResizeKeepsWhatThereIs)
{
  Scene scene;
  scene.registerFrames({0, 1});
  scene.model.resize(10);
  EXPECT_EQ(scene.model.numFrames(), 10u);
  EXPECT_FALSE(scene.model.isRegistered(9));
  EXPECT_TRUE(scene.model.isRegistered(1));
}

TEST(TrackOptions, RefuseBoundsThatNothingMeets)
{
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    TrackOptions sigmas, pixels;
    sigmas.max_sigmas = bad;
    pixels.max_pixel_error = bad;
    std::string error;
    EXPECT_FALSE(sigmas.isValid(&error));
    EXPECT_FALSE(pixels.isValid());
    EXPECT_EQ(error, "max_sigmas and max_pixel_error must be > 0");
  }
}
