// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/image_graph.h>

#include "landmarks.h"
#include "messages.h"

#include <opencv2/imgproc.hpp>
#include <pcl/exceptions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Every fourth frame of the room: 15 frames. */
std::vector<ImageNode>
roomNodes()
{
  std::vector<ImageNode> nodes;
  for (std::size_t i = 0; i < room().size(); i += 4)
    nodes.push_back({roomFeatures(i), room().timestamp(i)});
  return nodes;
}

const ImageGraph&
roomGraph()
{
  static const ImageGraph graph = [] {
    ImageGraph g(room().camera());
    g.append(roomNodes(), true);
    return g;
  }();
  return graph;
}

std::size_t
numConnected(const ImageGraph& graph, std::size_t start)
{
  std::vector<char> reached(graph.size(), 0);
  std::vector<std::size_t> open{start};
  reached[start] = 1;
  std::size_t count = 0;
  while (!open.empty()) {
    const std::size_t frame = open.back();
    open.pop_back();
    ++count;
    for (const ImageEdge& edge : graph.edges(frame))
      if (!reached[edge.neighbour]) {
        reached[edge.neighbour] = 1;
        open.push_back(edge.neighbour);
      }
  }
  return count;
}

} // namespace

TEST(ImageGraph, CorrelationIsTheSumOfMatches)
{
  const ImageGraph& graph = roomGraph();
  ASSERT_EQ(graph.size(), 15u);
  std::size_t ends = 0;
  for (std::size_t i = 0; i < graph.size(); ++i) {
    std::size_t matches = 0;
    for (const ImageEdge& edge : graph.edges(i)) {
      matches += edge.pair->matches.size();
      EXPECT_GE(edge.pair->matches.size(), ImageGraphOptions().matching.min_matches);
    }
    EXPECT_EQ(graph.correspondences(i), matches);
    EXPECT_TRUE(graph.isKey(i));
    EXPECT_EQ(graph.exclusion(i), "");
    EXPECT_EQ(graph.timestamp(i), room().timestamp(4 * i));
    ends += graph.edges(i).size();
  }
  EXPECT_EQ(ends, 2 * graph.numEdges());
}

TEST(ImageGraph, EdgesAreTheSameFromBothEnds)
{
  const ImageGraph& graph = roomGraph();
  for (std::size_t i = 0; i < graph.size(); ++i) {
    std::size_t last = 0;
    for (const ImageEdge& edge : graph.edges(i)) {
      EXPECT_NE(edge.neighbour, i);
      EXPECT_GE(edge.neighbour, last);
      last = edge.neighbour;
      EXPECT_EQ(edge.pair->first + edge.pair->second, i + edge.neighbour);
      EXPECT_LT(edge.pair->first, edge.pair->second);
      bool back = false;
      for (const ImageEdge& other : graph.edges(edge.neighbour))
        back |= other.neighbour == i && other.pair == edge.pair;
      EXPECT_TRUE(back);
    }
  }
}

TEST(ImageGraph, LeavesOutAnUnrelatedImage)
{
  RGBDFrame frame = room().read(0);
  cv::RNG random(3);
  random.fill(frame.color, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(frame.color, frame.color, {}, 1.5);
  std::vector<ImageNode> nodes = roomNodes();
  nodes.resize(4);
  nodes.push_back({extractFeatures(frame, room().camera()), 9});
  ASSERT_GT(nodes.back().features.size(), 100u);
  ImageGraph graph(room().camera());
  EXPECT_TRUE(graph.append(std::move(nodes), true));
  EXPECT_TRUE(graph.edges(4).empty());
  EXPECT_EQ(graph.correspondences(4), 0u);
  EXPECT_CONTAINS(graph.exclusion(4), "no other image shares 15 verified matches");
  EXPECT_CONTAINS(graph.exclusion(4), "features)");
  EXPECT_EQ(graph.exclusion(0), "");
}

TEST(ImageGraph, LeavesOutABlurredCopy)
{
  RGBDFrame frame = room().read(4);
  cv::GaussianBlur(frame.color, frame.color, {}, 3);
  std::vector<ImageNode> nodes = roomNodes();
  nodes.resize(4);
  nodes.push_back({extractFeatures(frame, room().camera()), 9});
  ImageGraph graph(room().camera());
  graph.append(std::move(nodes), true);
  ASSERT_FALSE(graph.edges(4).empty());
  EXPECT_EQ(graph.exclusion(4).rfind("blurred", 0), 0u) << graph.exclusion(4);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(graph.exclusion(i), "");
}

TEST(ImageGraph, ImagesAppendedInPartsGetTheSameEdges)
{
  const Landmarks landmarks(300);
  const std::vector<LandmarkView> views = landmarkViews(landmarks, 7);
  const ImageGraph at_once = toGraph(landmarks, views);
  std::vector<ImageNode> nodes = toNodes(views);
  ImageGraph in_parts(landmarks.camera());
  in_parts.append({nodes.begin(), nodes.begin() + 3}, true);
  EXPECT_EQ(in_parts.size(), 3u);
  in_parts.append({nodes.begin() + 3, nodes.end()}, true);
  ASSERT_EQ(in_parts.size(), 7u);
  EXPECT_EQ(at_once.numEdges(), 21u); // all see each other
  EXPECT_EQ(in_parts.numEdges(), at_once.numEdges());
  for (std::size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(in_parts.correspondences(i), at_once.correspondences(i));
    const std::vector<ImageEdge> a = in_parts.edges(i), b = at_once.edges(i);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
      EXPECT_EQ(a[k].neighbour, b[k].neighbour);
      EXPECT_EQ(a[k].pair->matches.size(), b[k].pair->matches.size());
      EXPECT_EQ(a[k].pair->first_from_second.matrix(), b[k].pair->first_from_second.matrix());
    }
  }
}

TEST(ImageGraph, ConnectsTheScanWithoutMatchingAllPairs)
{
  for (const bool ordered : {true, false}) {
    ImageGraphOptions options;
    options.exhaustive_limit = 5;
    options.num_similar = 3;
    options.num_similar_keys = 4;
    options.retrieval.training_size = 2000;
    ImageGraph graph(room().camera(), options);
    graph.append(roomNodes(), ordered);
    EXPECT_EQ(numConnected(graph, 0), graph.size());
    EXPECT_LT(graph.numEdges(), roomGraph().numEdges());
    std::size_t keys = 0;
    for (std::size_t i = 0; i < graph.size(); ++i)
      keys += graph.isKey(i);
    EXPECT_GE(keys, 1u);
  }
}

TEST(ImageGraph, StopsWhenAsked)
{
  const Landmarks landmarks(100);
  ImageGraphOptions options;
  options.matching.num_threads = 1;
  ImageGraph graph(landmarks.camera(), options);
  const auto stop = [](const Progress&) { return false; };
  EXPECT_FALSE(graph.append(toNodes(landmarkViews(landmarks, 5)), true, stop));
  EXPECT_EQ(graph.size(), 5u);
  EXPECT_EQ(graph.numEdges(), 1u);
}

TEST(ImageGraph, AnEmptyAppendChangesNothing)
{
  ImageGraph graph(room().camera());
  EXPECT_TRUE(graph.append({}, true));
  EXPECT_EQ(graph.size(), 0u);
  EXPECT_EQ(graph.numEdges(), 0u);
}

TEST(ImageGraph, WithoutDescriptorsNothingCanBeAppended)
{
  const Landmarks landmarks(100);
  const std::vector<LandmarkView> views = landmarkViews(landmarks, 3);
  ImageGraph graph = toGraph(landmarks, views);
  const std::size_t edges = graph.numEdges();
  graph.releaseDescriptors(true);
  EXPECT_FALSE(graph.features(1).descriptors.empty()); // all of a small scan are key frames
  graph.releaseDescriptors();
  EXPECT_TRUE(graph.features(1).descriptors.empty());
  EXPECT_EQ(graph.features(1).size(), views[1].features.size());
  EXPECT_EQ(graph.numEdges(), edges);
  EXPECT_NE(messageOf<pcl::BadArgumentException>([&] {
              graph.append(toNodes(views), true);
            }).find("descriptors were released"),
            std::string::npos);
  EXPECT_EQ(graph.size(), 3u);
}

TEST(ImageGraph, RefusesInvalidOptionsAndCameras)
{
  const auto message = [](const ImageGraphOptions& options) {
    return messageOf<pcl::BadArgumentException>([&] { ImageGraph(room().camera(), options); });
  };
  ImageGraphOptions options;
  options.min_relative_sharpness = 1;
  EXPECT_CONTAINS(message(options), "ImageGraph: min_relative_sharpness must lie in [0, 1)");
  options = {};
  options.key_similarity = 1;
  EXPECT_CONTAINS(message(options), "key_similarity must lie in [0, 1)");
  options = {};
  options.num_similar = 0;
  EXPECT_CONTAINS(message(options), "num_similar");
  options = {};
  options.matching.ratio = 2;
  EXPECT_CONTAINS(message(options), "ratio must lie in (0, 1]");
  options = {};
  options.retrieval.vocabulary_size = 0;
  EXPECT_CONTAINS(message(options), "vocabulary_size");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([] { ImageGraph{CameraIntrinsics()}; }),
                  "ImageGraph: ");
}
