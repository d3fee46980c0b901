// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/model/sparse_model_io.h>

#include "landmarks.h"
#include "messages.h"
#include "temporary_folder.h"

#include <pcl/exceptions.h>
#include <pcl/io/ply_io.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

struct Scene {
  Landmarks landmarks{80};
  std::vector<LandmarkView> views = landmarkViews(landmarks, 3);
  ImageGraph graph = toGraph(landmarks, views);
  SparseModel model{3};

  Scene()
  {
    for (std::size_t i = 0; i < 2; ++i)
      model.registerFrame(graph, i, views[i].world_from_camera, 0, {});
  }
};

} // namespace

TEST(SparseModelIO, CloudHasPointsInColourAndRedCameras)
{
  const Scene scene;
  const auto points = toPointCloud(scene.graph, scene.model, 0, false);
  const auto all = toPointCloud(scene.graph, scene.model, 0);
  ASSERT_EQ(points->size(), scene.model.points().size());
  ASSERT_EQ(all->size(), points->size() + 2);
  for (const auto& point : *points) {
    EXPECT_NEAR(point.r, 30, 1); // the landmarks are 10, 20, 30 in BGR
    EXPECT_NEAR(point.g, 20, 1);
    EXPECT_NEAR(point.b, 10, 1);
  }
  EXPECT_EQ(all->back().r, 255);
  EXPECT_EQ(all->back().g, 0);
  EXPECT_LT(
      (all->back().getVector3fMap() - scene.views[1].world_from_camera.translation().cast<float>())
          .norm(),
      1e-6f);
  EXPECT_TRUE(toPointCloud(scene.graph, scene.model, 1)->empty());
}

TEST(SparseModelIO, WritesWhatItReadsBack)
{
  const Scene scene;
  const TemporaryFolder folder;
  writeSparseModel(folder.path("sparse.ply"), scene.graph, scene.model);
  pcl::PointCloud<pcl::PointXYZRGB> cloud;
  ASSERT_EQ(pcl::io::loadPLYFile(folder.path("sparse.ply"), cloud), 0);
  const auto expected = toPointCloud(scene.graph, scene.model, 0);
  ASSERT_EQ(cloud.size(), expected->size());
  for (std::size_t k = 0; k < cloud.size(); ++k) {
    EXPECT_EQ(cloud[k].getVector3fMap(), (*expected)[k].getVector3fMap());
    EXPECT_EQ(cloud[k].r, (*expected)[k].r);
  }
}

TEST(SparseModelIO, NamesTheFileThatCannotBeWritten)
{
  const Scene scene;
  const TemporaryFolder folder;
  const std::string path = folder.path("absent/sparse.ply");
  EXPECT_CONTAINS(
      messageOf<pcl::IOException>([&] { writeSparseModel(path, scene.graph, scene.model); }), path);
}
