// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// A thing that moves before a camera that moves: pairs of images show two rigid motions.
#include <bundle_icp/graph/image_graph.h>

#include "landmarks.h"

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** A sixth of the image, where the thing is seen. */
const cv::Rect2f window(90, 60, 107, 120);

void
addFeature(const Features& from, std::size_t j, Features& to)
{
  to.pixels.push_back(from.pixels[j]);
  to.pixel_sigmas.push_back(from.pixel_sigmas[j]);
  to.depths.push_back(from.depths[j]);
  to.depth_sigmas.push_back(from.depth_sigmas[j]);
  to.colors.push_back(from.colors[j]);
  to.descriptors.push_back(from.descriptors.row(int(j)));
}

/** What the camera sees of the background around the thing, and of the thing in the window. */
Features
lookAtBoth(const LandmarkView& background, const LandmarkView& thing)
{
  Features both;
  both.sharpness = 1;
  for (std::size_t j = 0; j < background.features.size(); ++j)
    if (!window.contains(
            cv::Point2f(background.features.pixels[j].x(), background.features.pixels[j].y())))
      addFeature(background.features, j, both);
  for (std::size_t j = 0; j < thing.features.size(); ++j)
    if (window.contains(cv::Point2f(thing.features.pixels[j].x(), thing.features.pixels[j].y())))
      addFeature(thing.features, j, both);
  return both;
}

constexpr unsigned NUM_VIEWS = 6;

/** Background with little texture, and a thing with much, each seen along a path of its own. */
struct TwoMotions {
  Landmarks background{120}, thing{2500, 1};
  std::vector<LandmarkView> of_background = landmarkViews(background, NUM_VIEWS), of_thing;
  std::vector<Features> features;

  TwoMotions()
  {
    for (unsigned i = 0; i < NUM_VIEWS; ++i) {
      of_thing.push_back(thing.look(randomMotion(100 + i, 0.1, 0.3)));
      features.push_back(lookAtBoth(of_background[i], of_thing[i]));
    }
  }

  Pose
  truth(std::size_t i, std::size_t j) const
  {
    return of_background[i].world_from_camera.inverse() * of_background[j].world_from_camera;
  }
};

} // namespace

TEST(VerifyMatches, FindsTwoMotions)
{
  const TwoMotions both;
  const std::vector<FeatureMatch> putative =
      matchDescriptors(both.features[0].descriptors, both.features[1].descriptors);
  const FramePair pair =
      verifyMatches(both.features[0], both.features[1], putative, both.background.camera());
  EXPECT_GT(pair.matches.size(), pair.matches_of_other_motion.size());
  EXPECT_GE(pair.matches_of_other_motion.size(), 15u);
  EXPECT_LT((pair.other_first_from_second.matrix() - both.truth(0, 1).matrix()).norm(), 5e-3);
}

TEST(VerifyMatches, OneMotionHasNoOther)
{
  const Landmarks landmarks(600);
  const std::vector<LandmarkView> views = landmarkViews(landmarks, 2);
  std::vector<FeatureMatch> putative =
      matchDescriptors(views[0].features.descriptors, views[1].features.descriptors);
  // Half of the matches are wrong, and agree on nothing.
  for (std::size_t k = 0; k + 2 < putative.size() / 2; ++k)
    std::swap(putative[k].second, putative[k + 2].second);
  const FramePair pair =
      verifyMatches(views[0].features, views[1].features, putative, landmarks.camera());
  EXPECT_GT(pair.matches.size(), 50u);
  EXPECT_TRUE(pair.matches_of_other_motion.empty());
}

TEST(ImageGraph, OfTwoMotionsTheOneOfMoreOfTheImageCounts)
{
  const TwoMotions both;
  std::vector<ImageNode> nodes;
  for (const Features& features : both.features)
    nodes.push_back({features, 0.1 * double(nodes.size())});
  // One image shows nothing but the thing: no place in the room follows.
  nodes.push_back({lookAtBoth({noFeatures(), {}, Pose::Identity()}, both.of_thing[0]), 1});
  ImageGraph graph(both.background.camera());
  graph.append(nodes, true);
  EXPECT_EQ(graph.edges(0).size(), NUM_VIEWS - 1);
  EXPECT_TRUE(graph.edges(NUM_VIEWS).empty());
  for (std::size_t i = 0; i < NUM_VIEWS; ++i)
    for (const ImageEdge& edge : graph.edges(i))
      if (edge.pair->first == i) {
        EXPECT_LT(
            (edge.pair->first_from_second.matrix() - both.truth(i, edge.neighbour).matrix()).norm(),
            5e-3)
            << i << " " << edge.neighbour;
      }
}
