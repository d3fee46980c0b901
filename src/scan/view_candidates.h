// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "volume/seen_space.h"

#include <bundle_icp/scan/next_views.h>

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace bundle_icp {

/** A registered frame, with depth in few pixels. */
struct SeenFrame {
  std::size_t index = 0; ///< in ReconstructionResult::frames
  Pose world_from_camera = Pose::Identity();
  cv::Mat depth; ///< CV_32FC1 [m], as SeenScan::depth_camera sees it
};

/** What a scan has seen, and where surface is missing. */
struct SeenScan {
  CameraIntrinsics camera, depth_camera; ///< the latter has fewer pixels
  SeenSpace space;
  std::vector<std::uint8_t> gaps; ///< by cell, see findGaps()
  std::vector<SeenFrame> frames;
  std::array<double, 3> depths; ///< 5 %, 50 % and 95 % of the frames' depth is nearer [m]
};

/** What a camera would see. */
struct SeenView {
  Pose world_from_camera = Pose::Identity();
  /** First cell of a gap along a ray, and the ray's share of the area there [m^2]. */
  std::vector<std::pair<std::uint32_t, float>> missing;
  std::size_t frame = 0; ///< place in SeenScan::frames of the frame that shares most of it
  double shared = 0;     ///< share of the view that shows what that frame shows

  /** Missing area without the cells that are covered [m^2]. */
  double
  area(const std::vector<std::uint8_t>& covered) const;
};

/** Searches views from free space that show gaps and can be registered, see suggestViews(). */
class ViewSearch {
public:
  /** The scan must outlive this. */
  ViewSearch(const SeenScan& scan, const NextViewOptions& options);

  /** The view of most missing area, without the cells that are covered, times the share that it has
   *  in common with a frame; unset where no view is worth it. */
  std::optional<SeenView>
  best(const std::vector<std::uint8_t>& covered);

private:
  /** A place for a camera, and the gaps that are seen from there all around. */
  struct Place {
    Eigen::Vector3d center;
    std::vector<Eigen::Vector3d> directions;                     ///< towards `missing`
    std::vector<std::pair<std::uint32_t, float>> missing;        ///< as those of a SeenView
    std::vector<std::optional<std::optional<SeenView>>> by_axis; ///< once looked; unset = useless
  };
  struct Candidate {
    double area = 0; ///< roughly
    std::size_t place = 0, axis = 0;
    Eigen::Vector3d target; ///< direction
  };

  std::vector<Candidate>
  roughCandidates(const std::vector<std::uint8_t>& covered) const;

  const SeenScan& scan_;
  const NextViewOptions& options_;
  const std::vector<Eigen::Vector3d> axes_;
  std::vector<Place> places_;
};

/** Marks the cells of gaps that a view shows, those around them, and those behind them before which
 *  it has no surface. */
void
cover(const SeenScan& scan, const SeenView& view, std::vector<std::uint8_t>& covered);

/** What a ray meets first that is not free. */
enum class Met { NOTHING, SURFACE, GAP };

struct RayEnd {
  Met met = Met::NOTHING;
  std::size_t cell = 0;
  double distance = 0; ///< [m]
};

/** \param direction of unit length */
RayEnd
castRay(const SeenScan& scan, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

} // namespace bundle_icp
