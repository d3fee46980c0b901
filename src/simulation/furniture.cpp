// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/scene.h"

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

namespace bundle_icp {
namespace simulation {
namespace {

const Eigen::Vector3d room_half(2, 2.5, 1.5);
constexpr double TABLE_HEIGHT = 0.76;

using Painter = std::function<void(cv::Mat, cv::RNG&)>;

/** Places things in the scene; each is painted from its own random numbers, so that a
 * thing added does not change the others. */
class Furnisher {
public:
  Furnisher(Scene& scene, std::uint64_t seed) : scene_(scene), seed_(seed) {}

  void
  room();
  void
  table();
  void
  thingsOnTable();
  void
  shelf();
  void
  thingsOnFloor();
  void
  walls();

private:
  cv::RNG
  nextRandom()
  {
    // Splitmix: neighbouring numbers give unrelated pictures.
    std::uint64_t z = seed_ + 0x9e3779b97f4a7c15u * ++things_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return cv::RNG(z ^ (z >> 31));
  }

  /** A box of full extent `extent` [m], turned by `yaw` [rad] about z; `density`
   * [texel/m]. */
  void
  box(const Eigen::Vector3d& center, const Eigen::Vector3d& extent, double yaw, double density,
      const Painter& paint);
  void
  sphere(const Eigen::Vector3d& center, double radius, double density, const Painter& paint);
  void
  cylinder(const Eigen::Vector3d& center, double radius, double height,
           const Eigen::Matrix3d& rotation, double density, const Painter& paint);

  Scene& scene_;
  std::uint64_t seed_;
  std::uint64_t things_ = 0;
};

Eigen::Matrix3d
aboutZ(double yaw)
{
  return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

bool
isInRoom(const Eigen::Vector3d& point)
{
  return (point - Eigen::Vector3d(0, 0, room_half.z()))
             .cwiseAbs()
             .cwiseQuotient(room_half)
             .maxCoeff() < 1;
}

Painter
wood(const cv::Scalar& color, int board_width)
{
  return [=](cv::Mat canvas, cv::RNG& random) { paintWood(canvas, random, color, board_width); };
}

Painter
plaster(const cv::Scalar& color, float contrast)
{
  return [=](cv::Mat canvas, cv::RNG& random) { paintPlaster(canvas, random, color, contrast); };
}

void
Furnisher::box(const Eigen::Vector3d& center, const Eigen::Vector3d& extent, double yaw,
               double density, const Painter& paint)
{
  cv::RNG random = nextRandom();
  const BoxLayout layout = layoutBox(extent, density);
  cv::Mat image(layout.size, CV_8UC3, cv::Scalar::all(0));
  for (int side = 0; side < 6; ++side) {
    const Eigen::Vector3d outward = (side % 2 ? -1.0 : 1.0) * Eigen::Vector3d::Unit(side / 2);
    // What is in the wall or behind it is never seen.
    if (isInRoom(center + aboutZ(yaw) * outward.cwiseProduct(extent / 2)))
      paint(image(layout.sides[side]), random);
  }
  Primitive primitive;
  primitive.shape = Shape::BOX;
  primitive.world_from_local = aboutZ(yaw);
  primitive.center = center;
  primitive.half = extent / 2;
  scene_.addBox(primitive, layout, image);
}

void
Furnisher::sphere(const Eigen::Vector3d& center, double radius, double density,
                  const Painter& paint)
{
  cv::RNG random = nextRandom();
  const double cell = 2.2 * radius * density;
  cv::Mat image(int(2 * cell), int(3 * cell), CV_8UC3);
  paint(image, random);
  Primitive primitive;
  primitive.shape = Shape::SPHERE;
  primitive.center = center;
  primitive.half.setConstant(radius);
  scene_.addRound(primitive, image, density);
}

void
Furnisher::cylinder(const Eigen::Vector3d& center, double radius, double height,
                    const Eigen::Matrix3d& rotation, double density, const Painter& paint)
{
  cv::RNG random = nextRandom();
  cv::Mat image(int(height * density), int(2 * M_PI * radius * density), CV_8UC3);
  paint(image, random);
  Primitive primitive;
  primitive.shape = Shape::CYLINDER;
  primitive.world_from_local = rotation;
  primitive.center = center;
  primitive.half = {radius, radius, height / 2};
  scene_.addRound(primitive, image, density);
}

void
Furnisher::room()
{
  const auto paint = [this](double width, double height, double density, const Painter& painter) {
    cv::RNG random = nextRandom();
    cv::Mat image(int(height * density), int(width * density), CV_8UC3);
    painter(image, random);
    return image;
  };
  const Eigen::Vector3d size = 2 * room_half;
  const cv::Scalar wall(196, 208, 214), other_wall(170, 196, 190), floor(92, 128, 168);
  scene_.addRoom(room_half, {paint(size.y(), size.z(), 300, plaster(wall, 1)),
                             paint(size.y(), size.z(), 300, plaster(other_wall, 1)),
                             paint(size.x(), size.z(), 300, plaster(wall, 1)),
                             paint(size.x(), size.z(), 300, plaster(wall, 1)),
                             paint(size.x(), size.y(), 150, plaster({225, 228, 230}, 1)),
                             paint(size.x(), size.y(), 350, wood(floor, 42))});
}

void
Furnisher::table()
{
  const Eigen::Vector3d top(1.5, 0.9, 0.04);
  box({0, 0, TABLE_HEIGHT - 0.02}, top, 0, 700, wood({105, 150, 190}, 150));
  for (const double x : {-0.69, 0.69})
    for (const double y : {-0.39, 0.39})
      box({x, y, 0.36}, {0.06, 0.06, 0.72}, 0, 400, wood({70, 105, 140}, 60));
}

void
Furnisher::thingsOnTable()
{
  const auto on_table = [](double x, double y, double height) {
    return Eigen::Vector3d(x, y, TABLE_HEIGHT + height / 2);
  };
  sphere(on_table(-0.42, 0.18, 0.28), 0.14, 800, paintPicture); // a globe
  sphere(on_table(0.1, -0.3, 0.13), 0.065, 900, paintPicture);
  double height = 0; // a pile of books
  for (const double yaw : {0.2, 0.45, 0.1, -0.3}) {
    const Eigen::Vector3d extent(0.26 - 0.1 * height, 0.18, 0.035);
    box(on_table(0.42, 0.2, extent.z() + 2 * height), extent, yaw, 900, paintPackage);
    height += extent.z();
  }
  box(on_table(-0.12, 0.22, 0.3), {0.2, 0.08, 0.3}, 0.35, 900,
      paintPoster); // a cereal box
  box(on_table(0.12, 0.08, 0.12), {0.16, 0.1, 0.12}, -0.5, 900,
      paintPackage); // a carton
  cylinder(on_table(-0.25, -0.16, 0.11), 0.04, 0.11, aboutZ(1), 900,
           paintPackage); // a mug
  cylinder(on_table(0.32, -0.1, 0.16), 0.05, 0.16, aboutZ(2.5), 900,
           paintPicture); // a tin
  cylinder(on_table(-0.03, -0.08, 0.24), 0.035, 0.24, aboutZ(4), 900,
           paintPackage); // a bottle
  const Eigen::Matrix3d lying =
      aboutZ(0.6) * Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY()).toRotationMatrix();
  cylinder(on_table(-0.5, -0.25, 0.08), 0.04, 0.2, lying, 900, paintPicture);
  box(on_table(0.58, -0.22, 0.02), {0.21, 0.297, 0.02}, -0.15, 900,
      paintPackage); // a journal
  box(on_table(-0.2, -0.34, 0.012), {0.297, 0.21, 0.012}, 0.1, 900, paintPicture);
}

void
Furnisher::shelf()
{
  const double depth = 0.28, width = 1.2, left = -0.5, front = room_half.y() - depth;
  const double middle = room_half.y() - depth / 2;
  const cv::Scalar color(60, 92, 125);
  for (const double x : {left, left + width})
    box({x, middle, 0.9}, {0.025, depth, 1.8}, 0, 350, wood(color, 60));
  box({left + width / 2, room_half.y() - 0.01, 0.9}, {width, 0.02, 1.8}, 0, 250, wood(color, 60));
  cv::RNG random = nextRandom();
  for (const double height : {0.05, 0.48, 0.91, 1.34, 1.79}) {
    box({left + width / 2, middle, height}, {width, depth, 0.025}, 0, 350, wood(color, 60));
    double x = left + 0.03;
    while (height < 1.5 && x < left + width - 0.09) {
      const double thickness = random.uniform(0.025, 0.06), tall = random.uniform(0.2, 0.36);
      const double deep = random.uniform(0.15, 0.22);
      box({x + thickness / 2, front + 0.02 + deep / 2, height + 0.0125 + tall / 2},
          {thickness - 0.002, deep, tall}, 0, 500, paintPackage);
      x += thickness + (random.uniform(0, 6) == 0 ? 0.1 : 0.0);
    }
  }
  sphere({left + 0.3, middle, 1.8025 + 0.12}, 0.12, 500, paintPicture);
  box({left + 0.85, middle, 1.8025 + 0.1}, {0.35, 0.2, 0.2}, 0.2, 500, paintPackage);
}

void
Furnisher::thingsOnFloor()
{
  box({0, 0, 0.006}, {2.4, 1.7, 0.012}, 0, 500, paintRug);
  box({1.65, -1.2, 0.2}, {0.45, 0.6, 0.4}, 0.1, 500, paintPackage); // cartons
  box({1.68, -1.15, 0.53}, {0.4, 0.4, 0.26}, 0.4, 500, paintPackage);
  cylinder({-1.7, 1.2, 0.2}, 0.16, 0.4, aboutZ(1), 500, paintPicture); // a waste bin
  sphere({-1.6, -1.9, 0.22}, 0.22, 450, paintPicture);
  sphere({1.5, 1.7, 0.15}, 0.15, 450, paintPicture);
  box({-1.72, -0.3, 0.3}, {0.45, 1.3, 0.6}, 0, 450, wood({75, 110, 150}, 130)); // a sideboard
  cylinder({-1.7, -0.7, 0.6 + 0.15}, 0.07, 0.3, aboutZ(0), 700, paintPicture);
  box({-1.75, 0.05, 0.6 + 0.13}, {0.1, 0.4, 0.26}, 0.2, 700, paintPoster);
  cylinder({1.65, 0.9, 0.225}, 0.18, 0.45, aboutZ(0), 450, paintRug); // a stool
}

void
Furnisher::walls()
{
  const double thickness = 0.03, x = room_half.x(), y = room_half.y();
  struct Picture {
    int wall; // 0: +x, 1: -x, 2: +y, 3: -y
    double along, height, width, tall;
  };
  const Picture pictures[] = {
      {0, -1.9, 1.6, 0.6, 0.85},  {0, -1.1, 1.75, 0.7, 0.5},  {0, -0.2, 1.5, 0.84, 1.19},
      {0, 0.7, 1.8, 0.5, 0.7},    {0, 0.75, 1.15, 0.6, 0.42}, {0, 1.6, 1.6, 0.8, 0.6},
      {0, 2.1, 0.9, 0.42, 0.6},   {1, -2.0, 1.4, 0.6, 0.84},  {1, -1.1, 1.65, 0.84, 0.6},
      {1, -0.2, 1.5, 0.6, 0.84},  {1, 0.6, 1.75, 0.7, 0.5},   {1, 0.65, 1.15, 0.5, 0.42},
      {1, 1.9, 1.5, 0.9, 1.2},    {2, -1.3, 1.5, 0.84, 1.19}, {2, 1.3, 1.6, 0.7, 0.5},
      {2, 1.35, 1.0, 0.5, 0.5},   {3, -1.4, 1.5, 0.7, 1.0},   {3, -0.5, 1.7, 0.6, 0.42},
      {3, -0.5, 1.15, 0.6, 0.42}, {3, 1.3, 0.5, 0.8, 0.5},
  };
  for (const Picture& p : pictures) {
    const bool is_x = p.wall < 2;
    const double sign = p.wall % 2 ? -1 : 1;
    // Half of it is inside the wall: no gap, and no two surfaces in one place.
    box(is_x ? Eigen::Vector3d(sign * x, p.along, p.height)
             : Eigen::Vector3d(p.along, sign * y, p.height),
        is_x ? Eigen::Vector3d(thickness, p.width, p.tall)
             : Eigen::Vector3d(p.width, thickness, p.tall),
        0, 500, paintPoster);
  }
  box({0.55, -y, 1.05}, {0.9, 0.06, 2.1}, 0, 300, wood({80, 118, 160}, 130)); // a door
  sphere({0.12, -y + 0.08, 1.05}, 0.035, 600, plaster({120, 160, 175}, 1));
  sphere({0.5, -0.6, 3.0}, 0.2, 300, paintPicture); // a lamp, half of it in the ceiling
  for (const double beam : {-1.5, -0.5, 0.5, 1.5})
    box({0, beam, 3}, {4, 0.14, 0.2}, 0, 200, wood({70, 100, 130}, 30));
}

} // namespace

void
furnish(Scene& scene, std::uint64_t seed)
{
  Furnisher furnisher(scene, seed);
  furnisher.room();
  furnisher.table();
  furnisher.thingsOnTable();
  furnisher.shelf();
  furnisher.thingsOnFloor();
  furnisher.walls();
}

} // namespace simulation
} // namespace bundle_icp
