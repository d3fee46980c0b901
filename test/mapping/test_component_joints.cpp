// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/component_joints.h"
#include "mapping/joint_images.h"

#include "mapping/scans.h"
#include "messages.h"

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Two parts of a scan without any feature, each with right poses in a world of its own. */
struct TwoParts {
  Scan scan;
  ImageGraph graph{room().camera()};
  SparseModel model;
  MapperOptions options;
  Pose second_from_first = randomMotion(3, 1, 1);
  std::size_t num_first = 0;

  void
  place()
  {
    graph.append(scan.nodes, true);
    model.resize(scan.nodes.size());
    for (std::size_t i = 0; i < scan.nodes.size(); ++i)
      model.registerFrame(i, i < num_first ? scan.truth[i] : second_from_first * scan.truth[i],
                          i < num_first ? 0 : 1);
  }

  void
  addRoom(const std::vector<std::size_t>& frames)
  {
    for (const std::size_t i : frames)
      scan.add(noFeatures(), room().read(i).depth, room().worldFromCamera(i));
  }

  /** Frames inside an empty box, which looks the same when it is turned. */
  void
  addBox(const std::vector<double>& angles, double half_size)
  {
    for (const double angle : angles) {
      Pose pose = Pose::Identity();
      pose.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
      cv::Mat depth(scan.camera.height, scan.camera.width, CV_32FC1);
      for (int row = 0; row < depth.rows; ++row)
        for (int column = 0; column < depth.cols; ++column) {
          const Eigen::Vector3d ray = pose.linear() * scan.camera.unproject(column, row, 1);
          depth.at<float>(row, column) = float(half_size / ray.cwiseAbs().maxCoeff());
        }
      scan.add(noFeatures(), depth, pose);
    }
  }

  std::optional<MadeJoint>
  join()
  {
    const DepthViewProvider views = scan.provider();
    const FrameRegistrar registrar(graph, views, options.registration, options.adjustment);
    return ComponentJoiner(graph, views, registrar, options).joinNext(model);
  }
};

} // namespace

TEST(ComponentJoints, PartsOfOneRoomAreJoinedByShape)
{
  TwoParts parts;
  parts.addRoom({0, 2, 4});
  parts.num_first = 3;
  parts.addRoom({6, 8});
  parts.place();
  const auto joint = parts.join();
  ASSERT_TRUE(joint);
  EXPECT_EQ(joint->moved, (Part{3, 4}));
  EXPECT_EQ(joint->report.matches, 0u);
  EXPECT_EQ(parts.model.registeredFrames(0).size(), 5u);
  const PoseErrors errors = largestErrors(parts.model, parts.scan.truth, 0);
  EXPECT_LT(errors.distance, 0.01);
  EXPECT_LT(errors.angle, 0.3);
}

TEST(ComponentJoints, DifferentRoomsAreNotJoined)
{
  TwoParts parts;
  parts.addRoom({0, 2, 4});
  parts.num_first = 3;
  parts.addBox({0.3, 0.5}, 1.3);
  parts.place();
  EXPECT_FALSE(parts.join());
  EXPECT_EQ(parts.model.registeredFrames(0).size(), 3u);
}

TEST(ComponentJoints, ARoomThatLooksTheSameWhenTurnedIsNotJoined)
{
  TwoParts parts;
  parts.addBox({0, 0.4, 0.8, 1.2, 1.6, 2.0, 2.4, 2.8, 3.2, 3.6, 4.0, 4.4, 4.8, 5.2, 5.6, 6.0}, 1.5);
  parts.num_first = 16;
  parts.addBox({0.7, 0.9}, 1.5);
  parts.place();
  EXPECT_FALSE(parts.join());
}

TEST(ComponentJoints, ImagesOfAnotherRoomContradict)
{
  SyntheticScanOptions options;
  options.width = 320;
  options.height = 240;
  options.focal_length = 262.5;
  options.seed = 5; // the same shape, other textures
  const SyntheticScan repainted(options);
  Scan scan;
  scan.addRoom({0, 4, 2});
  scan.add(extractFeatures(repainted.read(0), repainted.camera()), repainted.read(0).depth,
           repainted.worldFromCamera(0));
  ImageGraph graph(room().camera());
  graph.append(scan.nodes, true);
  SparseModel model;
  model.resize(scan.nodes.size());
  for (std::size_t i = 0; i < scan.nodes.size(); ++i)
    model.registerFrame(i, scan.truth[i], 0);
  const auto compare = [&](const Part& second) {
    return compareImages(graph, model, scan.provider(), {0, 1}, second, Pose::Identity());
  };
  EXPECT_GT(compare({2}).expected, 100u);
  EXPECT_GT(double(compare({2}).alike), 0.4 * double(compare({2}).expected));
  EXPECT_FALSE(compare({2}).contradicts());
  EXPECT_TRUE(compare({3}).contradicts());
}
