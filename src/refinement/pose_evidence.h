// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/model/sparse_model.h>
#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <optional>

namespace bundle_icp {

/** How far the matches of a pair want its frames moved against each other: RMS over the matched
 *  points and the three axes, in standard deviations of a single matched point. The motion that the
 *  matches support is fitted to them all, so right poses give values far below 1. Common errors of
 *  the pair's images, which make no pose wrong, may add some tenths. */
double
displacementByMatches(const ImageGraph& graph, const SparseModel& model, const FramePair& pair);

/** What two depth images say of each other's poses, in numbers of pixels of a grid. */
struct DepthAgreement {
  double agree = 0;
  double in_front = 0; ///< nearer than the other image saw: the other looked through it
  double behind = 0;   ///< farther than the other image saw: hidden from it, no contradiction

  DepthAgreement&
  operator+=(const DepthAgreement& other)
  {
    agree += other.agree;
    in_front += other.in_front;
    behind += other.behind;
    return *this;
  }

  double
  compared() const
  {
    return agree + in_front;
  }
};

/** Depth within so many standard deviations agrees: each image as a whole is off by some. */
constexpr double AGREEING_SIGMAS = 4;

/** Pixels of one depth image beside what another one saw there. Refers to the views. */
class DepthComparison {
public:
  DepthComparison(const DepthView& view, const DepthView& other, const Pose& other_from_view);

  /** Whether a pixel has depth that lies at no edge. */
  static bool
  isPlain(const DepthView& view, int row, int column);

  /** Where a pixel lies in the other image. */
  struct Place {
    Eigen::Vector3d point; ///< in the frame of the other camera [m]
    int row = 0, column = 0;
    double sigma = 0; ///< standard deviation of the pixel's depth [m]
  };

  /** Nothing for a pixel without depth, and outside of the other image. */
  std::optional<Place>
  place(int row, int column) const;

  /** How far a point lies in front of the surface that the other image saw, along its normal, in
   *  standard deviations of both depths; negative = behind. Nothing where the other image has no
   *  depth or an edge of depth. */
  std::optional<double>
  sigmasInFront(const Place& place) const;

private:
  const DepthView& view_;
  const DepthView& other_;
  const Pose other_from_view_;
};

/** How compareDepth() works. */
struct DepthComparisonOptions {
  int pixels_along_width = 40; ///< compared pixels of a row
  double misplaced = 0;        ///< standard deviation of the position that the pose gives [m]
};

/** Compares pixels of one depth image with those of another one. Pixels at depth edges, and what
 *  lies outside of the other image, take no part. */
DepthAgreement
compareDepth(const DepthView& view, const DepthView& other, const Pose& other_from_view,
             const DepthComparisonOptions& options = {});

} // namespace bundle_icp
