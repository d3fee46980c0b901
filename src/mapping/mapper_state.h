// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "mapping/component_adjustment.h"

#include <bundle_icp/mapping/component_joint.h>

#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** What an IncrementalMapper does next. */
enum class MapperStage {
  NEXT_COMPONENT, ///< the first pair of a component
  KEY_FRAMES,     ///< growth by key frames
  ADJUSTMENT,     ///< self-calibration and adjustment with all evidence
  OTHER_FRAMES,   ///< growth by all others
  FRAMES_BY_TIME, ///< frames without matches, and the motion prior
  JOINT,          ///< a joint of parts by geometry, when no component is left to begin
  DONE
};

/** Growth of a component, see ComponentGrowth. */
struct GrowthState {
  /** A component of so many frames is adjusted for the first time. */
  static constexpr double FIRST_ADJUSTMENT = 8;

  int round = 0;                             ///< of growth and correction
  std::vector<char> failed;                  ///< frames that wait for the model to grow
  double next_adjustment = FIRST_ADJUSTMENT; ///< number of frames
  std::size_t size_at_failure = 0;           ///< of the component, when frames were last put back
};

/** All that an IncrementalMapper knows besides its SparseModel. */
struct MapperState {
  MapperStage stage = MapperStage::NEXT_COMPONENT;
  int component = 0;
  GrowthState growth;
  std::vector<FrameRegistration> registrations;
  /** V of equation (4) for the component that grows. */
  std::vector<std::size_t> visibility;
  /** Of poses that were found on their own, not adjusted with the others. */
  std::vector<std::optional<Matrix6d>> covariances;
  PosePriorReport pose_prior;
  std::vector<ComponentJoint> joints;
  AdjusterState adjuster;
};

/** State and model as bytes, the same for the same values, for machines of one kind. */
std::string
toBytes(const MapperState& state, const SparseModel& model);

/** The state and the model of toBytes().
 *  \throws boost::archive::archive_exception when the bytes end too early */
void
fromBytes(const std::string& bytes, MapperState& state, SparseModel& model);

} // namespace bundle_icp
