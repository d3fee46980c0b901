// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"
#include "rendered_frame.h"

#include <bundle_icp/volume/extract_surface.h>

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

Paint
plain(int value)
{
  return [value](const Eigen::Vector3d&) { return cv::Vec3b(value, value, value); };
}

// Mean colour of a wall that frames saw one by one.
double
brightness(const std::vector<std::pair<int, ColorCorrection>>& frames)
{
  TSDFVolume volume(coarseOptions());
  for (const auto& [value, correction] : frames)
    volume.integrate(render(plane({0, 0, 1}, 1.0), Pose::Identity(), plain(value)), smallCamera(),
                     Pose::Identity(), correction);
  const SurfaceMesh mesh = extractSurface(volume);
  double sum = 0;
  for (const auto& color : mesh.colors)
    sum += color[1] / double(mesh.colors.size());
  return sum;
}

ColorCorrection
correctionOf(float gain, float weight)
{
  ColorCorrection correction;
  correction.gain.setConstant(gain);
  correction.weight = weight;
  return correction;
}

} // namespace

TEST(ColorWeights, AFrameCountsAsMuchAsItsWeight)
{
  EXPECT_NEAR(brightness({{200, {}}, {100, {}}}), 150, 2);
  EXPECT_NEAR(brightness({{200, {}}, {100, correctionOf(1, 0.25F)}}), 180, 2);
  EXPECT_NEAR(brightness({{200, correctionOf(1, 0.1F)}, {100, {}}}), 109, 2);
}

TEST(ColorWeights, GainsUndoWhatExposureDid)
{
  EXPECT_NEAR(brightness({{200, {}}, {100, correctionOf(2, 1)}}), 200, 2);
  EXPECT_NEAR(brightness({{100, correctionOf(0.5F, 1)}}), 50, 1);
}

// The colour camera sees a red card 2 px farther right than the depth camera does, so that its
// colour falls on the wall behind. A second view of that part of the wall must win.
TEST(ColorWeights, NextToDepthEdgesAnotherViewDecides)
{
  const Intersection scene = [](const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    const double t = (0.8 - origin.z()) / ray.z();
    const Eigen::Vector3d point = origin + t * ray;
    const bool card = std::max(std::abs(point.x()), std::abs(point.y())) < 0.1;
    return card ? t : (1.2 - origin.z()) / ray.z();
  };
  const Paint paint = [](const Eigen::Vector3d& point) {
    return point.z() < 1 ? cv::Vec3b(0, 0, 240) : cv::Vec3b(120, 120, 120);
  };
  RGBDFrame shifted = render(scene, Pose::Identity(), paint);
  const cv::Mat color = shifted.color.clone();
  constexpr int shift = 2;
  color.colRange(0, color.cols - shift).copyTo(shifted.color.colRange(shift, color.cols));
  Pose aside = Pose::Identity();
  aside.translation().x() = 0.3;

  TSDFVolume volume(coarseOptions());
  volume.integrate(shifted, smallCamera(), Pose::Identity());
  volume.integrate(render(scene, aside, paint), smallCamera(), aside);
  const SurfaceMesh mesh = extractSurface(volume);
  int beside = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f& p = mesh.vertices[i];
    // The first camera sees the wall from x = 0.15 m on, behind the card's edge.
    if (p.z() < 1.15F || p.x() < 0.152F || p.x() > 0.18F || std::abs(p.y()) > 0.12F)
      continue;
    ++beside;
    EXPECT_NEAR(mesh.colors[i][2], 120, 8) << p.transpose();
    EXPECT_NEAR(mesh.colors[i][1], 120, 8) << p.transpose();
  }
  EXPECT_GT(beside, 30);
}

TEST(ColorWeights, RefusesImpossibleCorrections)
{
  const auto refusal = [](const ColorCorrection& correction) {
    TSDFVolume volume(coarseOptions());
    const std::string message = messageOf<pcl::BadArgumentException>([&] {
      volume.integrate(render(plane({0, 0, 1}, 1.0), Pose::Identity()), smallCamera(),
                       Pose::Identity(), correction);
    });
    EXPECT_EQ(volume.numBlocks(), 0u);
    return message;
  };
  EXPECT_NE(refusal(correctionOf(0, 1)).find("gain"), std::string::npos);
  EXPECT_NE(refusal(correctionOf(1, 0)).find("weight 0"), std::string::npos);
  EXPECT_NE(refusal(correctionOf(1, 1.5F)).find("weight 1.5"), std::string::npos);
}
