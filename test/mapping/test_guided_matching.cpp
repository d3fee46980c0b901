// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/guided_matching.h"

#include "landmarks.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Registered frames of which no two share an edge. */
struct Unconnected {
  Landmarks landmarks{300};
  std::vector<LandmarkView> views = landmarkViews(landmarks, 4);
  ImageGraph graph = unconnected();
  SparseModel model{4};

  ImageGraph
  unconnected() const
  {
    ImageGraphOptions options;
    options.matching.min_matches = 10000;
    ImageGraph result(landmarks.camera(), options);
    result.append(toNodes(views), true);
    return result;
  }

  /** Tracks of two frames and more; each must be of one landmark. */
  std::size_t
  tracksFound(int num_threads)
  {
    for (std::size_t i = 0; i < views.size(); ++i)
      model.registerFrame(graph, i, views[i].world_from_camera, 0, {});
    EXPECT_TRUE(model.points().empty());
    matchByPrediction(graph, {0, 1, 2, 3}, {}, num_threads, model);
    for (const ScenePoint& point : model.points())
      for (const Observation& o : point.track)
        EXPECT_EQ(views[o.frame].landmarks[o.feature],
                  views[point.track[0].frame].landmarks[point.track[0].feature]);
    return model.points().size();
  }
};

} // namespace

TEST(GuidedMatching, FindsPointsOfImagesWithoutAnEdge)
{
  Unconnected scene;
  EXPECT_EQ(scene.graph.numEdges(), 0u);
  EXPECT_GT(scene.tracksFound(1), 100u);
}

TEST(GuidedMatching, DoesNotDependOnThreads)
{
  Unconnected one, three;
  ASSERT_EQ(one.tracksFound(1), three.tracksFound(3));
  for (std::size_t p = 0; p < one.model.points().size(); ++p)
    EXPECT_EQ(one.model.points()[p].position, three.model.points()[p].position);
}

TEST(GuidedMatching, NeedsDescriptors)
{
  Unconnected scene;
  scene.graph.releaseDescriptors();
  EXPECT_EQ(scene.tracksFound(1), 0u);
}
