// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/moving_things.h"

#include "simulation/renderer.h"

#include <cmath>

namespace bundle_icp {
namespace simulation {
namespace {

constexpr double TEXELS = 700; // per metre

void
addBox(Scene& scene, cv::RNG& random, const Eigen::Vector3d& center, const Eigen::Vector3d& extent)
{
  Primitive box;
  box.center = center;
  box.half = extent / 2;
  const BoxLayout layout = layoutBox(extent, TEXELS);
  cv::Mat image(layout.size, CV_8UC3, cv::Scalar::all(0));
  for (const cv::Rect& side : layout.sides)
    paintPackage(image(side), random);
  scene.addBox(box, layout, image);
}

void
addSphere(Scene& scene, cv::RNG& random, const Eigen::Vector3d& center, double radius)
{
  Primitive sphere;
  sphere.shape = Shape::SPHERE;
  sphere.center = center;
  sphere.half.setConstant(radius);
  const double cell = 2.2 * radius * TEXELS;
  cv::Mat image(int(2 * cell), int(3 * cell), CV_8UC3);
  paintPicture(image, random);
  scene.addRound(sphere, image, TEXELS);
}

void
addCylinder(Scene& scene, cv::RNG& random, const Eigen::Vector3d& center, double radius,
            double height)
{
  Primitive cylinder;
  cylinder.shape = Shape::CYLINDER;
  cylinder.center = center;
  cylinder.half = {radius, radius, height / 2};
  cv::Mat image(int(height * TEXELS), int(2 * M_PI * radius * TEXELS), CV_8UC3);
  paintPicture(image, random);
  scene.addRound(cylinder, image, TEXELS);
}

/** A palm and two fingers in the lower third of the image, in the camera's frame. */
void
buildGripper(Scene& scene, cv::RNG& random)
{
  addBox(scene, random, {0, 0.19, 0.5}, {0.3, 0.14, 0.1});
  addBox(scene, random, {-0.09, 0.14, 0.58}, {0.04, 0.1, 0.16});
  addBox(scene, random, {0.09, 0.14, 0.58}, {0.04, 0.1, 0.16});
}

/** Legs, trunk and head; z up from the floor. */
void
buildPerson(Scene& scene, cv::RNG& random)
{
  addCylinder(scene, random, {0, 0.1, 0.42}, 0.08, 0.84);
  addCylinder(scene, random, {0, -0.1, 0.42}, 0.08, 0.84);
  addCylinder(scene, random, {0, 0, 1.15}, 0.19, 0.62);
  addSphere(scene, random, {0, 0, 1.6}, 0.13);
}

/** Around the table, near the walls, at about 1.2 m/s. */
Pose
personAt(double time, double start_angle)
{
  const double angle = start_angle + 0.65 * time;
  Pose world_from_person = Pose::Identity();
  world_from_person.linear() =
      Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  world_from_person.translation() << 1.72 * std::cos(angle), 2.1 * std::sin(angle), 0;
  return world_from_person;
}

} // namespace

Scene
turntableScene(const SyntheticScanOptions& options)
{
  Scene scene(options.texture);
  cv::RNG random(options.seed * 2 + 0x707);
  addCylinder(scene, random, {0, 0, -0.01}, 0.18, 0.02);
  addCylinder(scene, random, {0, 0, -1.02}, 0.03, 2);
  addBox(scene, random, {0.07, 0.03, 0.08}, {0.08, 0.12, 0.16});
  addCylinder(scene, random, {-0.08, 0.05, 0.1}, 0.035, 0.2);
  addSphere(scene, random, {-0.02, -0.09, 0.05}, 0.05);
  return scene;
}

Pose
roomFromTurntable(const Pose& room_from_camera, double time)
{
  constexpr double distance = 0.75, speed = M_PI / 6;
  Pose room_from_turntable = Pose::Identity();
  room_from_turntable.translation() = room_from_camera * Eigen::Vector3d(0, 0, distance);
  room_from_turntable.linear() =
      Eigen::AngleAxisd(speed * time, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return room_from_turntable;
}

MovingThings::MovingThings(const SyntheticScanOptions& options,
                           const std::function<Pose(double time)>& world_from_room)
{
  cv::RNG random(options.seed * 2 + 0x60d);
  if (options.gripper) {
    things_.push_back({Scene(options.texture),
                       [](double, const Pose& world_from_camera) { return world_from_camera; }});
    buildGripper(things_.back().scene, random);
  }
  if (options.person) {
    const double start = random.uniform(0.0, 2 * M_PI);
    things_.push_back({Scene(options.texture), [start, world_from_room](double time, const Pose&) {
                         return world_from_room(time) * personAt(time, start);
                       }});
    buildPerson(things_.back().scene, random);
  }
  if (options.turntable)
    things_.push_back(
        {Scene(options.seed, options.texture),
         [world_from_room](double time, const Pose&) { return world_from_room(time); }});
}

void
MovingThings::draw(const CameraIntrinsics& camera, const Pose& world_from_camera, double time,
                   cv::Mat& depth, cv::Mat* color) const
{
  for (const Thing& thing : things_) {
    const Pose pose = thing.world_from_thing(time, world_from_camera).inverse() * world_from_camera;
    const GeometryImage geometry = renderGeometry(thing.scene, camera, pose);
    const cv::Mat nearer = (geometry.face >= 0) & ((geometry.depth < depth) | (depth == 0));
    geometry.depth.copyTo(depth, nearer);
    if (color)
      renderColor(thing.scene, camera, pose, geometry).copyTo(*color, nearer);
  }
}

cv::Mat
MovingThings::coverage(const CameraIntrinsics& camera, const Pose& world_from_camera, double time,
                       const cv::Mat& depth) const
{
  cv::Mat with_them = depth.clone();
  draw(camera, world_from_camera, time, with_them, nullptr);
  return with_them < depth;
}

} // namespace simulation
} // namespace bundle_icp
