// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace bundle_icp {
namespace simulation {

/** Image with its reductions, sampled without aliasing. */
class Texture {
public:
  /** \param[in] image CV_8UC3, BGR */
  explicit Texture(const cv::Mat& image);

  /** Mean colour, BGR of 255, over the parallelogram of a pixel.
   *  \param[in] uv centre [texel], outside is the colour of the border
   *  \param[in] dx, dy edges of the parallelogram [texel] */
  Eigen::Array4f
  sample(const Eigen::Vector2f& uv, const Eigen::Vector2f& dx, const Eigen::Vector2f& dy) const;

private:
  struct Level {
    std::vector<std::uint32_t> texels; ///< BGRx, 8 bits each
    int width = 0, height = 0;
    float scale = 1; ///< texels of this level per texel of the image
  };

  static Eigen::Array4f
  bilinear(const Level& level, const Eigen::Vector2f& uv);
  Eigen::Array4f
  trilinear(const Eigen::Vector2f& uv, float lod) const;

  std::vector<Level> levels_;
};

/** Places of the six sides of a box (+x, -x, +y, -y, +z, -z) in its texture. */
struct BoxLayout {
  std::array<cv::Rect, 6> sides;
  cv::Size size;
};

/** Side views first in a row, top and bottom below.
 *  \param[in] extent edges of the box [m]
 *  \param[in] density [texel/m] */
BoxLayout
layoutBox(const Eigen::Vector3d& extent, double density);

/** Painters of pictures, all of them determined by the state of `random` alone; they
 * fill `canvas` (CV_8UC3, BGR). @{ */
/** Overlapping blots of all sizes, which have the statistics of photographs. */
void
paintPicture(cv::Mat canvas, cv::RNG& random);
/** A picture in a frame, with a line of text. */
void
paintPoster(cv::Mat canvas, cv::RNG& random);
/** Plain colour with bands and text, as on spines of books and on packages. */
void
paintPackage(cv::Mat canvas, cv::RNG& random);
/** Boards of wood along the longer side. */
void
paintWood(cv::Mat canvas, cv::RNG& random, const cv::Scalar& color, int board_width);
/** Painted wall: faint noise, stains and scratches. */
void
paintPlaster(cv::Mat canvas, cv::RNG& random, const cv::Scalar& color, float contrast);
/** Woven pattern of diamonds within borders. */
void
paintRug(cv::Mat canvas, cv::RNG& random);
/** @} */

} // namespace simulation
} // namespace bundle_icp
