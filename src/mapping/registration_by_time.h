// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "mapping/prior_motions.h"
#include "registration/frame_registrar.h"

#include <bundle_icp/mapping/incremental_mapper.h>

#include <vector>

namespace bundle_icp {

/** A frame that was tried, and what came of it. */
struct FrameByTime {
  std::size_t frame = 0;
  FrameRegistration registration;
};

/** Registers frames without visual evidence, when they are ordered in time: each starts from its
 *  neighbours in time, forwards and then backwards, by the prior or as the camera moved before, and
 *  geometry decides.
 *  \return the frames that were tried, in order; some twice */
std::vector<FrameByTime>
registerByTime(const ImageGraph& graph, const FrameRegistrar& registrar,
               const MapperOptions& options, const PriorMotions& prior, int component,
               SparseModel& model);

} // namespace bundle_icp
