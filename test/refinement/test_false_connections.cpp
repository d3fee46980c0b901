// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/false_connections.h"

#include "landmarks.h"

#include <gtest/gtest.h>

#include <algorithm>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr std::size_t NUM_HERE = 5, NUM_THERE = 3;

void
append(const LandmarkView& from, std::size_t j, Features& to)
{
  const Features& f = from.features;
  to.pixels.push_back(f.pixels[j]);
  to.pixel_sigmas.push_back(f.pixel_sigmas[j]);
  to.depths.push_back(f.depths[j]);
  to.depth_sigmas.push_back(f.depth_sigmas[j]);
  to.colors.push_back(f.colors[j]);
  to.descriptors.push_back(f.descriptors.row(int(j)));
}

/** Frames of two places with landmarks of their own, and a thing that stands in both of them. The
 *  last frame here and the first there also share landmarks: more than the thing has. */
struct TwoPlaces {
  const Landmarks landmarks{300}, thing{45, 7};
  const Pose there_from_here = randomMotion(3, 0.1, 0.4); ///< of the thing
  std::vector<LandmarkView> views;
  ImageGraph graph;

  TwoPlaces() : graph(landmarks.camera())
  {
    for (std::size_t i = 0; i < NUM_HERE + NUM_THERE; ++i)
      views.push_back(look(i));
    graph.append(toNodes(views), true);
  }

  LandmarkView
  look(std::size_t frame) const
  {
    const Pose world_from_camera = randomMotion(unsigned(frame), 0.1, 0.3);
    const bool is_there = frame >= NUM_HERE;
    const bool is_between = frame + 1 == NUM_HERE || frame == NUM_HERE;
    LandmarkView view;
    view.world_from_camera = world_from_camera;
    view.features.sharpness = 1;
    const LandmarkView all = landmarks.look(world_from_camera);
    for (std::size_t j = 0; j < all.landmarks.size(); ++j)
      if (all.landmarks[j] < 100 ? !is_there : all.landmarks[j] < 200 ? is_there : is_between)
        append(all, j, view.features);
    const LandmarkView twin =
        thing.look(is_there ? there_from_here.inverse() * world_from_camera : world_from_camera);
    for (std::size_t j = 0; j < twin.landmarks.size(); ++j)
      append(twin, j, view.features);
    return view;
  }

  /** Frames of the second place where the thing alone would have them. */
  SparseModel
  model(bool is_false) const
  {
    SparseModel result(graph.size());
    for (std::size_t i = 0; i < graph.size(); ++i)
      result.registerFrame(graph, i,
                           is_false && i >= NUM_HERE
                               ? there_from_here.inverse() * views[i].world_from_camera
                               : views[i].world_from_camera,
                           0, {});
    return result;
  }

  double
  largestError(const SparseModel& model) const
  {
    double largest = 0;
    for (std::size_t i = 0; i < graph.size(); ++i)
      largest = std::max(
          largest,
          (model.worldFromCamera(i).matrix() - views[i].world_from_camera.matrix()).norm());
    return largest;
  }
};

/** Points that frames of both places show. */
std::size_t
numShared(const SparseModel& model)
{
  std::size_t count = 0;
  for (const ScenePoint& point : model.points()) {
    const auto there = std::count_if(point.track.begin(), point.track.end(),
                                     [](const Observation& o) { return o.frame >= NUM_HERE; });
    if (there > 0 && std::size_t(there) < point.track.size())
      ++count;
  }
  return count;
}

} // namespace

TEST(FalseConnections, ImagesMoveToWhereMostPointsPutThem)
{
  const TwoPlaces places;
  SparseModel model = places.model(true);
  ASSERT_GT(places.largestError(model), 0.3);
  const std::size_t shared = numShared(model);
  ASSERT_GT(shared, 0u); // the thing's
  EXPECT_EQ(correctFalseConnections(places.graph, 0, {}, 1, model), NUM_THERE);
  EXPECT_LT(places.largestError(model), 1e-3);
  EXPECT_GT(numShared(model), shared);
  EXPECT_EQ(correctFalseConnections(places.graph, 0, {}, 1, model), 0u);
}

TEST(FalseConnections, DoNotDependOnThreads)
{
  const TwoPlaces places;
  SparseModel one = places.model(true), four = places.model(true);
  EXPECT_EQ(correctFalseConnections(places.graph, 0, {}, 1, one),
            correctFalseConnections(places.graph, 0, {}, 4, four));
  for (std::size_t i = 0; i < places.graph.size(); ++i)
    EXPECT_EQ(one.worldFromCamera(i).matrix(), four.worldFromCamera(i).matrix());
}

TEST(FalseConnections, RightPosesStay)
{
  const TwoPlaces places;
  SparseModel model = places.model(false);
  EXPECT_EQ(correctFalseConnections(places.graph, 0, {}, 1, model), 0u);
  EXPECT_EQ(places.largestError(model), 0);
}

TEST(FalseConnections, OtherComponentsTakeNoPart)
{
  const TwoPlaces places;
  SparseModel model = places.model(true);
  for (std::size_t i = NUM_HERE; i < places.graph.size(); ++i)
    model.registerFrame(i, model.worldFromCamera(i), 1);
  EXPECT_EQ(correctFalseConnections(places.graph, 0, {}, 1, model), 0u);
  EXPECT_EQ(correctFalseConnections(places.graph, 1, {}, 1, model), 0u);
  EXPECT_GT(places.largestError(model), 0.3);
}
