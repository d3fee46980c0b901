// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "simulation/texture.h"

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace bundle_icp {
namespace simulation {

enum class Shape { BOX, ROOM, SPHERE, CYLINDER };

/** A solid; a ROOM is a box seen from inside. Axis of the cylinder: z. */
struct Primitive {
  Shape shape = Shape::BOX;
  Eigen::Matrix3d world_from_local = Eigen::Matrix3d::Identity();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d half = Eigen::Vector3d::Zero();  ///< half extents of the bounding box [m]
  int first_face = 0;                              ///< of 6 (cylinder: side, top, bottom)
  Eigen::Vector3f light = Eigen::Vector3f::Zero(); ///< where it is, in the primitive's frame [m]
  Eigen::Vector3f up = Eigen::Vector3f::UnitZ();   ///< the world's z axis in the primitive's frame
};

/** How a side of a primitive is textured. Planar sides: texel = gradient * point +
 * offset. */
struct Face {
  int texture = 0;
  int primitive = 0;
  Eigen::Matrix<float, 2, 3> gradient; ///< [texel/m], in the frame of the primitive
  Eigen::Vector2f offset;              ///< [texel]
};

/** Point where the ray origin + depth * direction meets a surface. */
struct Hit {
  double depth = 0;
  int face = -1; ///< -1 = nothing
};

/** Distance along a ray, in lengths of `direction`, both in the primitive's frame, to
 * the nearest point of the surface beyond `direction` * 0; face -1 when there is none.
 * `face` counts from the primitive's first. */
Hit
intersect(const Primitive& primitive, const Eigen::Vector3d& origin,
          const Eigen::Vector3d& direction);

/** Unsigned distance [m] from a point in the primitive's frame to its surface. */
double
surfaceDistance(const Primitive& primitive, const Eigen::Vector3d& point);

/** Outward normal (inward for a ROOM) in the primitive's frame, of a point on side
 * `side`. */
Eigen::Vector3f
surfaceNormal(const Primitive& primitive, int side, const Eigen::Vector3f& point);

/** Room, furniture and objects. World frame: z up, floor at z = 0, the table at the origin. */
class Scene {
public:
  /** \param[in] texture contrast of the pictures on all surfaces, 0 to 1 */
  Scene(std::uint64_t seed, double texture);

  /** Without anything. */
  explicit Scene(double texture) : texture_(texture) {}

  const std::vector<Primitive>&
  primitives() const
  {
    return primitives_;
  }

  const Face&
  face(int index) const
  {
    return faces_[index];
  }

  double
  distanceToSurface(const Eigen::Vector3d& point) const;

  /** Colour of a surface point in its light.
   *  \param[in] point where, in the primitive's frame
   *  \param[in] dx, dy edges of the pixel's parallelogram on the surface, same frame
   * [m] */
  Eigen::Array4f
  color(int face, const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
        const Eigen::Vector3f& dx, const Eigen::Vector3f& dy) const;

  void
  addBox(Primitive box, const BoxLayout& layout, cv::Mat image);
  void
  addRoom(const Eigen::Vector3d& half, const std::array<cv::Mat, 6>& sides);
  void
  addRound(Primitive primitive, cv::Mat image, double density);

private:
  int
  addTexture(const cv::Mat& image);
  /** Registers `primitive` with its faces' first index and its light. */
  void
  addPrimitive(Primitive primitive);

  double texture_;
  std::vector<Primitive> primitives_;
  std::vector<Face> faces_;
  std::vector<Texture> textures_;
};

/** Fills the scene with all primitives. */
void
furnish(Scene& scene, std::uint64_t seed);

} // namespace simulation
} // namespace bundle_icp
