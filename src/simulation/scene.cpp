// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bundle_icp {
namespace simulation {
namespace {

const Eigen::Vector3d light_position(0.5, -0.6, 2.6);

/** Axis and sign of side +x, -x, +y, -y, +z, -z, and the axes along which its picture's
 *  columns and rows run as seen from outside, z up. */
struct Side {
  int axis, sign, column_axis, column_sign, row_axis, row_sign;
};
constexpr Side BOX_SIDES[6] = {{0, 1, 1, 1, 2, -1},  {0, -1, 1, -1, 2, -1}, {1, 1, 0, -1, 2, -1},
                               {1, -1, 0, 1, 2, -1}, {2, 1, 0, 1, 1, -1},   {2, -1, 0, 1, 1, 1}};

Hit
intersectBox(const Primitive& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)
{
  double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
  int enter_axis = 0, leave_axis = 0;
  for (int axis = 0; axis < 3; ++axis) {
    // A component of zero would give 0 * infinity on the slab's border.
    const double inverse = 1 / (direction[axis] == 0 ? 1e-300 : direction[axis]);
    const double reach = std::abs(inverse) * box.half[axis];
    const double middle = -origin[axis] * inverse;
    if (middle - reach > enter) {
      enter = middle - reach;
      enter_axis = axis;
    }
    if (middle + reach < leave) {
      leave = middle + reach;
      leave_axis = axis;
    }
  }
  if (box.shape == Shape::ROOM)
    return {leave, 2 * leave_axis + (direction[leave_axis] < 0)};
  if (enter > leave || enter <= 0)
    return {};
  return {enter, 2 * enter_axis + (direction[enter_axis] > 0)};
}

Hit
intersectSphere(const Primitive& sphere, const Eigen::Vector3d& origin,
                const Eigen::Vector3d& direction)
{
  const double length = direction.squaredNorm();
  const double closest = -origin.dot(direction) / length;
  const double radius = sphere.half.x();
  const double room = radius * radius - (origin + closest * direction).squaredNorm();
  if (room < 0)
    return {};
  const double depth = closest - std::sqrt(room / length);
  if (depth <= 0)
    return {};
  const Eigen::Vector3d point = origin + depth * direction;
  int axis;
  point.cwiseAbs().maxCoeff(&axis);
  return {depth, 2 * axis + (point[axis] < 0)};
}

Hit
intersectCylinder(const Primitive& cylinder, const Eigen::Vector3d& origin,
                  const Eigen::Vector3d& direction)
{
  const double radius = cylinder.half.x(), height = cylinder.half.z();
  if (std::abs(origin.z()) > height && direction.z() * origin.z() < 0) {
    const double depth = (std::copysign(height, origin.z()) - origin.z()) / direction.z();
    if ((origin + depth * direction).head<2>().squaredNorm() <= radius * radius)
      return {depth, origin.z() > 0 ? 1 : 2};
  }
  const double length = direction.head<2>().squaredNorm();
  if (length == 0)
    return {};
  const double closest = -origin.head<2>().dot(direction.head<2>()) / length;
  const double room = radius * radius - (origin + closest * direction).head<2>().squaredNorm();
  if (room < 0)
    return {};
  const double depth = closest - std::sqrt(room / length);
  if (depth <= 0 || std::abs(origin.z() + depth * direction.z()) > height)
    return {};
  return {depth, 0};
}

/** Texel of a sphere's or a cylinder's point, and how it moves with the point. */
void
roundTexel(const Primitive& primitive, int side, const Face& face, const Eigen::Vector3f& point,
           Eigen::Vector2f& texel, Eigen::Matrix<float, 2, 3>& gradient)
{
  if (primitive.shape == Shape::CYLINDER) {
    const float angle = std::atan2(point.y(), point.x()), radius = float(primitive.half.x());
    gradient << -point.y() / radius, point.x() / radius, 0, 0, 0, -1;
    gradient *= face.gradient(0, 0);
    texel = face.offset + face.gradient(0, 0) * Eigen::Vector2f(angle * radius, -point.z());
    return;
  }
  // Central projection to the cube around the sphere: no poles.
  const Side& s = BOX_SIDES[side];
  const float scale = float(primitive.half.x()) / std::abs(point[s.axis]);
  const Eigen::Vector3f on_cube = point * scale;
  texel = face.offset + face.gradient * on_cube;
  gradient = face.gradient * scale;
  gradient.col(s.axis) -= face.gradient * on_cube / point[s.axis];
}

} // namespace

Hit
intersect(const Primitive& primitive, const Eigen::Vector3d& origin,
          const Eigen::Vector3d& direction)
{
  switch (primitive.shape) {
  case Shape::SPHERE:
    return intersectSphere(primitive, origin, direction);
  case Shape::CYLINDER:
    return intersectCylinder(primitive, origin, direction);
  default:
    return intersectBox(primitive, origin, direction);
  }
}

double
surfaceDistance(const Primitive& primitive, const Eigen::Vector3d& point)
{
  if (primitive.shape == Shape::SPHERE)
    return std::abs(point.norm() - primitive.half.x());
  Eigen::Vector3d beyond = point.cwiseAbs() - primitive.half;
  if (primitive.shape == Shape::CYLINDER)
    beyond = {point.head<2>().norm() - primitive.half.x(), beyond.z(), beyond.z()};
  const double inside = beyond.maxCoeff();
  if (primitive.shape == Shape::CYLINDER)
    beyond.z() = 0; // radius and height are its only two extents
  return inside <= 0 ? -inside : beyond.cwiseMax(0).norm();
}

Eigen::Vector3f
surfaceNormal(const Primitive& primitive, int side, const Eigen::Vector3f& point)
{
  if (primitive.shape == Shape::SPHERE)
    return point.normalized();
  if (primitive.shape == Shape::CYLINDER)
    return side == 0 ? Eigen::Vector3f(point.x(), point.y(), 0).normalized()
                     : Eigen::Vector3f(0, 0, side == 1 ? 1.f : -1.f);
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  normal[side / 2] = (side % 2 ? -1.f : 1.f) * (primitive.shape == Shape::ROOM ? -1.f : 1.f);
  return normal;
}

Scene::Scene(std::uint64_t seed, double texture) : texture_(texture)
{
  furnish(*this, seed);
}

double
Scene::distanceToSurface(const Eigen::Vector3d& point) const
{
  double distance = std::numeric_limits<double>::infinity();
  for (const Primitive& primitive : primitives_)
    distance =
        std::min(distance, surfaceDistance(primitive, primitive.world_from_local.transpose() *
                                                          (point - primitive.center)));
  return distance;
}

Eigen::Array4f
Scene::color(int face_index, const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
             const Eigen::Vector3f& dx, const Eigen::Vector3f& dy) const
{
  const Face& face = faces_[face_index];
  const Primitive& primitive = primitives_[face.primitive];
  const int side = face_index - primitive.first_face;
  Eigen::Vector2f texel;
  Eigen::Matrix<float, 2, 3> gradient = face.gradient;
  if (primitive.shape == Shape::SPHERE || (primitive.shape == Shape::CYLINDER && side == 0))
    roundTexel(primitive, side, face, point, texel, gradient);
  else
    texel = face.gradient * point + face.offset;
  const Eigen::Array4f albedo = textures_[face.texture].sample(texel, gradient * dx, gradient * dy);

  const Eigen::Vector3f to_light = primitive.light - point;
  const float distance2 = to_light.squaredNorm();
  const float lambert = std::max(0.f, normal.dot(to_light) / std::sqrt(distance2));
  const float light =
      0.52f + 0.1f * normal.dot(primitive.up) + 0.5f * lambert / (0.7f + 0.12f * distance2);
  return albedo * light;
}

void
Scene::addPrimitive(Primitive primitive)
{
  const Eigen::Matrix3d local_from_world = primitive.world_from_local.transpose();
  primitive.light = (local_from_world * (light_position - primitive.center)).cast<float>();
  primitive.up = local_from_world.col(2).cast<float>();
  primitive.first_face = int(faces_.size()) - 6;
  primitives_.push_back(primitive);
}

int
Scene::addTexture(const cv::Mat& image)
{
  cv::Mat faded;
  image.convertTo(faded, CV_8UC3, texture_);
  faded += (1 - texture_) * cv::mean(image);
  textures_.emplace_back(texture_ == 1 ? image : faded);
  return int(textures_.size()) - 1;
}

void
Scene::addBox(Primitive box, const BoxLayout& layout, cv::Mat image)
{
  const int texture = addTexture(image);
  for (int side = 0; side < 6; ++side) {
    const Side& s = BOX_SIDES[side];
    const cv::Rect& rect = layout.sides[side];
    Face face;
    face.texture = texture;
    face.primitive = int(primitives_.size());
    face.gradient.setZero();
    face.gradient(0, s.column_axis) =
        float(s.column_sign * rect.width / (2 * box.half[s.column_axis]));
    face.gradient(1, s.row_axis) = float(s.row_sign * rect.height / (2 * box.half[s.row_axis]));
    face.offset = {float(rect.x) + 0.5f * float(rect.width) - 0.5f,
                   float(rect.y) + 0.5f * float(rect.height) - 0.5f};
    faces_.push_back(face);
  }
  addPrimitive(box);
}

void
Scene::addRoom(const Eigen::Vector3d& half, const std::array<cv::Mat, 6>& sides)
{
  Primitive room;
  room.shape = Shape::ROOM;
  room.half = half;
  room.center.z() = half.z();
  for (int side = 0; side < 6; ++side) {
    const Side& s = BOX_SIDES[side];
    Face face;
    face.texture = addTexture(sides[side]);
    face.primitive = int(primitives_.size());
    face.gradient.setZero();
    // Seen from inside, the columns run the other way.
    face.gradient(0, s.column_axis) =
        float(-s.column_sign * sides[side].cols / (2 * half[s.column_axis]));
    face.gradient(1, s.row_axis) = float(s.row_sign * sides[side].rows / (2 * half[s.row_axis]));
    face.offset = {0.5f * float(sides[side].cols) - 0.5f, 0.5f * float(sides[side].rows) - 0.5f};
    faces_.push_back(face);
  }
  addPrimitive(room);
}

void
Scene::addRound(Primitive primitive, cv::Mat image, double density)
{
  const int texture = addTexture(image);
  const bool is_sphere = primitive.shape == Shape::SPHERE;
  for (int side = 0; side < 6; ++side) {
    // The ends of a cylinder are laid out like top and bottom of a box.
    const Side& s = BOX_SIDES[is_sphere ? side : (side == 1 ? 4 : 5)];
    const float step = float(2.2 * primitive.half.x() * density);
    Face face;
    face.texture = texture;
    face.primitive = int(primitives_.size());
    face.gradient.setZero();
    face.gradient(0, s.column_axis) = float(s.column_sign * density);
    face.gradient(1, s.row_axis) = float(s.row_sign * density);
    face.offset = {0.5f * float(image.cols), 0.5f * float(image.rows)};
    if (is_sphere)
      face.offset = {step * (0.5f + float(side % 3)), step * (0.5f + float(side / 3))};
    faces_.push_back(face);
  }
  addPrimitive(primitive);
}

} // namespace simulation
} // namespace bundle_icp
