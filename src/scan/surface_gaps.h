// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "volume/seen_space.h"

#include <bundle_icp/common/oriented_box.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace bundle_icp {

/** Cells of unseen space where surface is missing: those on the continuation of a mesh beyond its
 *  boundary, where that meets surface again within `max_gap` [m]. A boundary where free space
 *  begins at once is an outline, and no surface is missing there.
 *  \param region gaps outside of it do not count; unset = no limit
 *  \return for each cell of `space`, whether it is one */
std::vector<std::uint8_t>
findGaps(const SurfaceMesh& mesh, const SeenSpace& space, double max_gap,
         const std::optional<OrientedBox>& region);

} // namespace bundle_icp
