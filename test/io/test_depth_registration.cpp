// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Depth that is moved into the colour camera stays what was measured.
#include "io/recordings/depth_registration.h"

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include <cmath>
#include <limits>

using namespace bundle_icp;

namespace {

const float not_measured = std::numeric_limits<float>::quiet_NaN();

CameraIntrinsics
camera(int width, int height, double focal_length)
{
  CameraIntrinsics result;
  result.width = width;
  result.height = height;
  result.fx = result.fy = focal_length;
  result.cx = 0.5 * (width - 1);
  result.cy = 0.5 * (height - 1);
  return result;
}

/** Like that of a phone: depth of few pixels, beside the colour camera and turned a little. */
DepthCamera
phone()
{
  DepthCamera depth;
  depth.intrinsics = camera(128, 96, 105);
  depth.color_from_depth.linear() =
      Eigen::AngleAxisd(0.03, Eigen::Vector3d(1, 2, 0.5).normalized()).toRotationMatrix();
  depth.color_from_depth.translation() << 0.025, -0.004, 0.003;
  return depth;
}

const CameraIntrinsics color = camera(320, 240, 262);

/** Points with normal * x = distance in the frame of the colour camera [m]. */
struct Plane {
  Eigen::Vector3d normal;
  double distance;

  /** Depth along a ray of a camera, whose z is 1. */
  double
  depth(const Eigen::Vector3d& ray, const Pose& color_from_camera) const
  {
    return (distance - normal.dot(color_from_camera.translation())) /
           normal.dot(color_from_camera.linear() * ray);
  }
};

Plane
tilted(double degrees)
{
  const double angle = degrees * M_PI / 180;
  return {Eigen::Vector3d(std::sin(angle), 0.2, std::cos(angle)).normalized(), 1.5};
}

/** The ray of a pixel, by Newton's method on OpenCV's lens. */
Eigen::Vector3d
rayOf(const CameraIntrinsics& lens, double u, double v)
{
  const Eigen::Vector2d seen((u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy);
  const auto distort = [&lens](const Eigen::Vector2d& p) {
    const double r = p.squaredNorm();
    const double radial = 1 + r * (lens.k1 + r * (lens.k2 + r * lens.k3));
    return Eigen::Vector2d(
        p.x() * radial + 2 * lens.p1 * p.x() * p.y() + lens.p2 * (r + 2 * p.x() * p.x()),
        p.y() * radial + lens.p1 * (r + 2 * p.y() * p.y()) + 2 * lens.p2 * p.x() * p.y());
  };
  Eigen::Vector2d ray = seen;
  for (int i = 0; i < 20; ++i) {
    const double step = 1e-6;
    Eigen::Matrix2d jacobian;
    jacobian << (distort(ray + Eigen::Vector2d(step, 0)) - distort(ray)) / step,
        (distort(ray + Eigen::Vector2d(0, step)) - distort(ray)) / step;
    ray += jacobian.inverse() * (seen - distort(ray));
  }
  return {ray.x(), ray.y(), 1};
}

/** What a depth camera measures of a plane. */
cv::Mat
render(const Plane& plane, const DepthCamera& depth)
{
  cv::Mat image(depth.intrinsics.height, depth.intrinsics.width, CV_32FC1);
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u)
      image.at<float>(v, u) =
          float(plane.depth(rayOf(depth.intrinsics, u, v), depth.color_from_depth));
  return image;
}

/** Pixel of the depth camera, without distortion, in which a point of the colour camera lies. */
Eigen::Vector2d
inDepthImage(const DepthCamera& depth, const Eigen::Vector3d& point)
{
  return depth.intrinsics.project(depth.color_from_depth.inverse() * point);
}

bool
isWithin(const Eigen::Vector2d& pixel, const CameraIntrinsics& image, double margin)
{
  return pixel.x() >= margin && pixel.y() >= margin && pixel.x() <= image.width - 1 - margin &&
         pixel.y() <= image.height - 1 - margin;
}

/** A wall at 2 m and before it a box at 0.8 m, both facing the colour camera [m]. */
double
boxBeforeWall(const Eigen::Vector3d& ray, const Eigen::Vector3d& origin)
{
  const Eigen::Vector3d on_box = origin + ray * ((0.8 - origin.z()) / ray.z());
  const bool is_box = std::abs(on_box.x()) < 0.15 && std::abs(on_box.y() + 0.03) < 0.12;
  return ((is_box ? 0.8 : 2.0) - origin.z()) / ray.z();
}

} // namespace

TEST(DepthRegistration, APlaneStaysAPlaneWithoutHoles)
{
  for (const double degrees : {0.0, 30.0, 45.0}) {
    const Plane plane = tilted(degrees);
    const DepthCamera depth = phone();
    const cv::Mat moved = DepthRegistration(depth, color).toColor(render(plane, depth));
    ASSERT_EQ(moved.size(), cv::Size(320, 240));
    for (int v = 0; v < moved.rows; ++v)
      for (int u = 0; u < moved.cols; ++u) {
        const double z = plane.depth(color.unproject(u, v, 1), Pose::Identity());
        const Eigen::Vector2d seen = inDepthImage(depth, color.unproject(u, v, z));
        const float found = moved.at<float>(v, u);
        if (isWithin(seen, depth.intrinsics, 0.01)) {
          ASSERT_NEAR(found, z, 2e-5 * z) << u << ", " << v << " at " << degrees;
        }
        else if (!isWithin(seen, depth.intrinsics, -0.01)) {
          ASSERT_TRUE(std::isnan(found)) << u << ", " << v << " at " << degrees;
        }
      }
  }
}

TEST(DepthRegistration, RemovesTheLensOfDepth)
{
  DepthCamera depth = phone();
  depth.intrinsics.k1 = -0.2;
  depth.intrinsics.k2 = 0.05;
  depth.intrinsics.p1 = 0.002;
  depth.intrinsics.p2 = -0.001;
  const Plane plane = tilted(40);
  const cv::Mat moved = DepthRegistration(depth, color).toColor(render(plane, depth));
  std::size_t measured = 0;
  for (int v = 0; v < moved.rows; ++v)
    for (int u = 0; u < moved.cols; ++u) {
      const float found = moved.at<float>(v, u);
      const double z = plane.depth(color.unproject(u, v, 1), Pose::Identity());
      if (std::isnan(found))
        continue;
      ++measured;
      ASSERT_NEAR(found, z, 1e-4 * z) << u << ", " << v;
    }
  EXPECT_GT(measured, moved.total() * 9 / 10);
}

TEST(DepthRegistration, NoiseOfAPlaneDoesNotGrow)
{
  const DepthCamera depth = phone();
  for (const double degrees : {0.0, 45.0}) {
    const Plane plane = tilted(degrees);
    cv::Mat measured = render(plane, depth), noise(measured.size(), CV_32FC1);
    cv::RNG random(7);
    random.fill(noise, cv::RNG::NORMAL, 0, 0.004);
    const cv::Mat moved = DepthRegistration(depth, color).toColor(measured + noise);
    double sum = 0, squares = 0, number = 0;
    for (int v = 0; v < moved.rows; ++v)
      for (int u = 0; u < moved.cols; ++u)
        if (const float found = moved.at<float>(v, u); !std::isnan(found)) {
          const double error = found - plane.depth(color.unproject(u, v, 1), Pose::Identity());
          sum += error;
          squares += error * error;
          ++number;
        }
    EXPECT_LT(std::sqrt(squares / number), 0.004) << degrees;
    EXPECT_LT(std::abs(sum / number), 0.1 * 0.004) << degrees;
    EXPECT_GT(number, 0.9 * double(moved.total())) << degrees;
  }
}

TEST(DepthRegistration, NothingShinesThroughAndNoEdgeIsBridged)
{
  for (const double side : {-0.06, 0.06}) {
    DepthCamera depth;
    depth.intrinsics = camera(128, 96, 105);
    depth.color_from_depth.translation() << side, 0.02, 0;
    cv::Mat measured(96, 128, CV_32FC1);
    for (int v = 0; v < measured.rows; ++v)
      for (int u = 0; u < measured.cols; ++u)
        measured.at<float>(v, u) = float(boxBeforeWall(depth.intrinsics.unproject(u, v, 1),
                                                       depth.color_from_depth.translation()));
    const cv::Mat moved = DepthRegistration(depth, color).toColor(measured);
    std::size_t seen_by_both = 0, measured_of_these = 0;
    for (int v = 0; v < moved.rows; ++v)
      for (int u = 0; u < moved.cols; ++u) {
        const float found = moved.at<float>(v, u);
        const double z = boxBeforeWall(color.unproject(u, v, 1), Eigen::Vector3d::Zero());
        const Eigen::Vector3d point = depth.color_from_depth.inverse() * color.unproject(u, v, z);
        const Eigen::Vector2d pixel = depth.intrinsics.project(point);
        const bool is_seen =
            isWithin(pixel, depth.intrinsics, 0) &&
            std::abs(boxBeforeWall(point / point.z(), depth.color_from_depth.translation()) -
                     point.z()) < 0.01;
        if (!std::isnan(found)) {
          ASSERT_NEAR(found, z, 1e-4) << u << ", " << v << " from " << side;
          ASSERT_TRUE(is_seen) << u << ", " << v << " from " << side;
        }
        seen_by_both += is_seen;
        measured_of_these += is_seen && !std::isnan(found);
      }
    // What is lost is a band along the edges, a pixel of the depth image wide.
    EXPECT_GT(double(measured_of_these), 0.94 * double(seen_by_both));
  }
}

TEST(DepthRegistration, WhatIsNotMeasuredStaysSo)
{
  DepthCamera depth;
  depth.intrinsics = camera(160, 120, 131);
  const DepthRegistration registration(depth, color);
  cv::Mat measured(120, 160, CV_32FC1, cv::Scalar(1.5));
  const cv::Rect hole(40, 30, 20, 10);
  measured(hole).setTo(not_measured);
  measured.at<float>(80, 80) = 0.7f; // a fault of the sensor: no surface is so small
  const cv::Mat moved = registration.toColor(measured);
  const cv::Mat inside = moved(cv::Rect(82, 62, 36, 16));
  EXPECT_EQ(cv::countNonZero(inside == inside), 0);
  for (int v = 0; v < moved.rows; ++v)
    for (int u = 0; u < moved.cols; ++u)
      if (const float z = moved.at<float>(v, u); !std::isnan(z)) {
        ASSERT_NEAR(z, 1.5, 1e-5);
      }
  EXPECT_FLOAT_EQ(moved.at<float>(200, 300), 1.5f);
  EXPECT_TRUE(std::isnan(moved.at<float>(160, 160)));
  measured.setTo(not_measured);
  const cv::Mat none = registration.toColor(measured);
  EXPECT_EQ(cv::countNonZero(none == none), 0);
}

TEST(DepthRegistration, TheSameCameraChangesNothing)
{
  const DepthCamera depth{color};
  const Plane plane = tilted(30);
  const cv::Mat measured = render(plane, depth);
  const cv::Mat moved = DepthRegistration(depth, color).toColor(measured);
  EXPECT_EQ(cv::countNonZero(moved != moved), 0);
  EXPECT_LT(cv::norm(moved, measured, cv::NORM_INF), 1e-5);
}
