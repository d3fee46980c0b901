// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "registration/scenes.h"

#include <bundle_icp/graph/image_graph.h>

#include <cmath>
#include <random>
#include <vector>

namespace bundle_icp::test {

/** Features of an image and the landmarks that they show. */
struct LandmarkView {
  Features features;
  std::vector<int> landmarks; ///< ascending
  Pose world_from_camera = Pose::Identity();
};

/** Points that every camera recognises: features with exact depth, without images. */
class Landmarks {
public:
  /** `count` points in a box of 3 x 2 m and a depth of twice `half_depth`, 2.25 m
   * before the origin. */
  explicit Landmarks(int count, unsigned seed = 0, double half_depth = 0.75)
  : camera_(smallCamera(320, 240, 262.5)), descriptors_(count, 128, CV_8UC1)
  {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < count; ++i) {
      const double x = uniform(random), y = uniform(random), z = uniform(random);
      points_.emplace_back(1.5 * x, y, 2.25 + half_depth * z);
      randomDescriptor(random, descriptors_.ptr<std::uint8_t>(i));
    }
  }

  const CameraIntrinsics&
  camera() const
  {
    return camera_;
  }

  const Eigen::Vector3d&
  point(int landmark) const
  {
    return points_[landmark];
  }

  const cv::Mat&
  descriptors() const
  {
    return descriptors_;
  }

  LandmarkView
  look(const Pose& world_from_camera) const
  {
    LandmarkView view;
    view.world_from_camera = world_from_camera;
    view.features.sharpness = 1;
    for (int i = 0; i < int(points_.size()); ++i) {
      const Eigen::Vector3d p = world_from_camera.inverse() * points_[i];
      if (p.z() > 0.3 && camera_.contains(camera_.project(p)))
        add(i, p, view);
    }
    return view;
  }

private:
  static void
  randomDescriptor(std::mt19937& random, std::uint8_t* descriptor)
  {
    std::normal_distribution<double> normal;
    double values[128], sum = 0;
    for (double& value : values) {
      value = std::abs(normal(random));
      sum += value * value;
    }
    for (int k = 0; k < 128; ++k)
      descriptor[k] = std::uint8_t(std::min(127.0, 256 * values[k] / std::sqrt(sum) + 0.5));
  }

  void
  add(int landmark, const Eigen::Vector3d& in_camera, LandmarkView& view) const
  {
    Features& f = view.features;
    f.pixels.push_back(camera_.project(in_camera).cast<float>());
    f.pixel_sigmas.push_back(0.7f);
    f.depths.push_back(float(in_camera.z()));
    f.depth_sigmas.push_back(float(DepthNoise().sigma(in_camera.z())));
    f.colors.emplace_back(10, 20, 30);
    f.descriptors.push_back(descriptors_.row(landmark));
    view.landmarks.push_back(landmark);
  }

  CameraIntrinsics camera_;
  std::vector<Eigen::Vector3d> points_;
  cv::Mat descriptors_;
};

/** Views of the landmarks from around the origin. */
inline std::vector<LandmarkView>
landmarkViews(const Landmarks& landmarks, unsigned count)
{
  std::vector<LandmarkView> views;
  for (unsigned i = 0; i < count; ++i)
    views.push_back(landmarks.look(randomMotion(i, 0.1, 0.3)));
  return views;
}

inline std::vector<ImageNode>
toNodes(const std::vector<LandmarkView>& views)
{
  std::vector<ImageNode> nodes;
  for (const LandmarkView& view : views)
    nodes.push_back({view.features, 0.1 * double(nodes.size())});
  return nodes;
}

/** The graph of the views: exact matches between all of them. */
inline ImageGraph
toGraph(const Landmarks& landmarks, const std::vector<LandmarkView>& views)
{
  ImageGraph graph(landmarks.camera());
  graph.append(toNodes(views), true);
  return graph;
}

/** An image in which nothing is found. */
inline Features
noFeatures()
{
  Features features;
  features.descriptors.create(0, 128, CV_8UC1);
  return features;
}

/** Features of a frame of the room(), found once per program. */
inline const Features&
roomFeatures(std::size_t frame)
{
  static std::vector<Features> all(room().size());
  if (all[frame].size() == 0)
    all[frame] = extractFeatures(room().read(frame), room().camera());
  return all[frame];
}

} // namespace bundle_icp::test
