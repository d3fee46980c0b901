// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/model/sparse_model.h>

namespace bundle_icp {

/** Corrects false connections between the key frames of a component.
 *
 *  Objects that occur twice in a scene join two places by matches that no test of a pair can tell
 *  from true matches. Frames registered through such matches continue from a wrong place. Where
 *  they meet other frames of the same place, many matches contradict the poses and only the few
 *  false matches agree. The maximum spanning tree of the frames, by number of matches, shows this:
 *  where an edge of the tree is contradicted, weaker edges have joined the frames. The smaller of
 *  the two parts that such an edge connects moves to where the edge puts it, if the parts then
 *  share more points. Points count, not matches: one object, seen in many frames, is weak evidence.
 *
 *  After a move the tracks of the component are built again. \return number of moved frames. */
std::size_t
correctFalseConnections(const ImageGraph& graph, int component, const TrackOptions& options,
                        int num_threads, SparseModel& model);

} // namespace bundle_icp
