// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/image_graph.h>
#include <bundle_icp/graph/image_retrieval.h>

#include "landmarks.h"
#include "variants.h"

#include <algorithm>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr std::size_t COUNT = 7;

const Landmarks&
landmarks()
{
  static const Landmarks all(250);
  return all;
}

ImageGraph
graphOf(const std::vector<LandmarkView>& views, const ImageGraphOptions& options = {})
{
  ImageGraph graph(landmarks().camera(), options);
  EXPECT_TRUE(graph.append(toNodes(views), true));
  return graph;
}

void
expectSameEdges(const ImageGraph& a, const ImageGraph& b)
{
  ASSERT_EQ(a.numEdges(), b.numEdges());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::vector<ImageEdge> of_a = a.edges(i), of_b = b.edges(i);
    ASSERT_EQ(of_a.size(), of_b.size());
    for (std::size_t k = 0; k < of_a.size(); ++k) {
      EXPECT_EQ(of_a[k].neighbour, of_b[k].neighbour);
      EXPECT_EQ(of_a[k].pair->matches.size(), of_b[k].pair->matches.size());
      EXPECT_EQ(of_a[k].pair->first_from_second.matrix(), of_b[k].pair->first_from_second.matrix());
    }
  }
}

/** The same features in another order. */
Features
reversed(const Features& features)
{
  Features result = features;
  std::reverse(result.pixels.begin(), result.pixels.end());
  std::reverse(result.depths.begin(), result.depths.end());
  result.descriptors = cv::Mat(); // which the copy shares
  cv::flip(features.descriptors, result.descriptors, 0);
  return result;
}

} // namespace

TEST(GraphInvariances, OrderOfImages)
{
  std::vector<LandmarkView> views = landmarkViews(landmarks(), COUNT);
  const ImageGraph forwards = graphOf(views);
  std::reverse(views.begin(), views.end());
  const ImageGraph backwards = graphOf(views);
  EXPECT_EQ(backwards.numEdges(), forwards.numEdges());
  for (std::size_t i = 0; i < COUNT; ++i) {
    EXPECT_EQ(backwards.correspondences(COUNT - 1 - i), forwards.correspondences(i)) << i;
    EXPECT_EQ(backwards.edges(COUNT - 1 - i).size(), forwards.edges(i).size()) << i;
  }
}

TEST(GraphInvariances, ThreadsAndSimdVariants)
{
  const std::vector<LandmarkView> views = landmarkViews(landmarks(), COUNT);
  const ImageGraph reference = graphOf(views);
  forEachVariant([&] {
    for (const int num_threads : {1, 3}) {
      ImageGraphOptions options;
      options.matching.num_threads = options.retrieval.num_threads = num_threads;
      expectSameEdges(graphOf(views, options), reference);
    }
  });
}

TEST(GraphInvariances, EachEdgeHoldsTheMotionOfItsImages)
{
  // Wherever the world's origin is: images know nothing of it.
  const std::vector<LandmarkView> views = landmarkViews(landmarks(), COUNT);
  const ImageGraph graph = graphOf(views);
  for (std::size_t i = 0; i < COUNT; ++i)
    for (const ImageEdge& edge : graph.edges(i)) {
      const Pose truth = views[edge.pair->first].world_from_camera.inverse() *
                         views[edge.pair->second].world_from_camera;
      EXPECT_LT(logarithm(edge.pair->first_from_second * truth.inverse()).norm(), 1e-4);
    }
}

TEST(GraphInvariances, HigherBoundsLeaveFewerEdges)
{
  const std::vector<LandmarkView> views = landmarkViews(landmarks(), COUNT);
  const ImageGraph all = graphOf(views);
  std::size_t fewest = 10000, most = 0;
  for (std::size_t i = 0; i < COUNT; ++i)
    for (const ImageEdge& edge : all.edges(i)) {
      fewest = std::min(fewest, edge.pair->matches.size());
      most = std::max(most, edge.pair->matches.size());
    }
  ASSERT_LT(fewest, most);
  ImageGraphOptions options;
  options.matching.min_matches = fewest;
  EXPECT_EQ(graphOf(views, options).numEdges(), all.numEdges());
  options.matching.min_matches = fewest + 1;
  EXPECT_LT(graphOf(views, options).numEdges(), all.numEdges());
  options.matching.min_matches = most;
  EXPECT_GE(graphOf(views, options).numEdges(), 1u);
  options.matching.min_matches = most + 1;
  EXPECT_EQ(graphOf(views, options).numEdges(), 0u);
}

TEST(GraphInvariances, RetrievalTakesFeaturesAsASet)
{
  RetrievalOptions options;
  options.training_size = 2000;
  std::vector<const Features*> images;
  for (std::size_t i = 0; i < 5; ++i)
    images.push_back(&roomFeatures(10 * i));
  ImageRetrieval retrieval(images, options);
  retrieval.add(*images[2]);
  retrieval.add(reversed(*images[2]));
  EXPECT_NEAR(retrieval.similarity(2, 5), 1, 1e-6); // as the same image
  EXPECT_NEAR(retrieval.similarity(2, 6), 1, 1e-5);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(retrieval.similarity(i, 6), retrieval.similarity(i, 2), 1e-5) << i;
}
