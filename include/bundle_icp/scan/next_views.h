// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/oriented_box.h>
#include <bundle_icp/common/pose.h>
#include <bundle_icp/common/progress.h>
#include <bundle_icp/io/rgbd_dataset.h>

#include <opencv2/core/mat.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

struct ReconstructionResult;

/** Which views suggestViews() looks for. */
struct BUNDLE_ICP_EXPORT NextViewOptions {
  static constexpr std::size_t MAX_VIEWS = 10;
  std::size_t max_views = MAX_VIEWS; ///< largest number of suggestions, 1 to MAX_VIEWS
  /** Views that would show less of what no frame has seen are left out [m^2], 0.0001 to 100. */
  double min_area = 0.05;
  /** Smallest share of a suggested view, 0.05 to 0.9, that shows surface which one frame saw from a
   *  similar side and distance: by this share the new frame can be registered. */
  double min_shared = 0.25;
  /** Largest width of a gap between surfaces, as a multiple of the scan's median depth, 0.1 to 5. A
   *  surface that ends without another one so near counts as the end of the scan. */
  double max_gap = 1;
  /** Gaps outside of this box of the world do not count; unset = no limit. */
  std::optional<OrientedBox> region;
  int num_threads = 0; ///< 0 = all; the result does not depend on it

  bool
  isValid(std::string* error = nullptr) const;
};

/** What a suggested view is for. */
enum class NextViewPurpose {
  CLOSE_HOLE,       ///< "close_hole": shows surface that is missing between seen surfaces
  CONNECT_COMPONENT ///< "connect_component": lies between two parts of the scan
};

/** Name of a purpose, as in the comments above. */
BUNDLE_ICP_EXPORT const char*
toString(NextViewPurpose purpose);

/** A view that would add to a scan. Frames are indices of ReconstructionResult::frames. */
struct NextView {
  NextViewPurpose purpose = NextViewPurpose::CLOSE_HOLE;
  /** Where to take it, in space that frames have seen to be free, upright as the nearest frame. For
   *  CONNECT_COMPONENT that of nearest_frame, from which to go on to what other_frame shows. */
  Pose world_from_camera = Pose::Identity();
  /** CLOSE_HOLE: the frame that shows most of what the view shows. CONNECT_COMPONENT: the frame of
   *  component 0 that is most like other_frame. */
  std::size_t nearest_frame = 0;
  double distance = 0; ///< of the view from nearest_frame [m]
  double angle = 0;    ///< between the axes of both [rad]

  // For CLOSE_HOLE.
  Eigen::Vector3d center = Eigen::Vector3d::Zero(); ///< middle of the hole, in the world [m]
  /** Missing area as the view shows it, across its rays [m^2], without what better suggestions
   *  show. */
  double area = 0;
  double shared = 0; ///< share of the view that shows surface which nearest_frame shows

  // For CONNECT_COMPONENT.
  int component = 0;           ///< the one that is not connected with component 0
  std::size_t other_frame = 0; ///< its frame that is most like nearest_frame

  /** Picture of 320 px width, CV_8UC3 BGR. CLOSE_HOLE: the mesh from there, what is missing in
   *  magenta. CONNECT_COMPONENT: the colour images of nearest_frame and other_frame. */
  cv::Mat picture;
};

/** One line for a person with a camera: where to stand, relative to a frame, and what to look at.
 *  \param result that of which the view was suggested */
BUNDLE_ICP_EXPORT std::string
toString(const NextView& view, const ReconstructionResult& result);

/** Views that would connect the components of a scan, larger ones first, and then those that would
 *  close the largest holes, the best first.
 *
 *  Where the mesh ends, its surface is continued. If the continuation goes through space that no
 *  frame has seen and meets surface again, that space is a gap: a hole, the shadow of an object,
 *  the floor below a table. Where it meets nothing, the scan just ends. Candidates look at the gaps
 *  from free space, as far away as the scan's own cameras were from what they saw (a next best
 *  view, Connolly 1985, Bircher et al. 2016). The best shows most of gaps that it shares enough
 *  known surface with one frame to be registered; what it would show then counts no more. Not more
 *  than half of the views are for components.
 *
 *  Holes need the mesh: without one only components count. Depth of the frames of component 0 is
 *  read again; frames that cannot be read are left out.
 *  \param dataset that of which `result` was made
 *  \throws pcl::BadArgumentException for invalid options, or a dataset of another size. */
BUNDLE_ICP_EXPORT std::vector<NextView>
suggestViews(const RGBDDataset& dataset, const ReconstructionResult& result,
             const NextViewOptions& options = {}, const ProgressCallback& progress = {});

} // namespace bundle_icp
