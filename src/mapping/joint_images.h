// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "mapping/joint_evidence.h"

namespace bundle_icp {

/** What the images of two parts say of a motion between them. */
struct ImageAgreement {
  std::size_t expected = 0; ///< features that a frame of the other part should show as well
  std::size_t alike = 0;    ///< those of them that it does show

  /** Rooms of one shape look different: hardly any feature is found again. White walls have none
   *  that could be. */
  bool
  contradicts() const
  {
    return expected >= FEWEST_EXPECTED && double(alike) < LEAST_ALIKE * double(expected);
  }

  static constexpr std::size_t FEWEST_EXPECTED = 40;
  static constexpr double LEAST_ALIKE = 0.12;
};

/** Looks for features of the second part where the motion says that frames of the first show them,
 *  among frames that see a point from similar sides and distances. */
ImageAgreement
compareImages(const ImageGraph& graph, const SparseModel& model,
              const DepthViewProvider& depth_views, const Part& first, const Part& second,
              const Pose& first_from_second);

} // namespace bundle_icp
