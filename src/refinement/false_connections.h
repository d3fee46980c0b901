// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/model/sparse_model.h>

namespace bundle_icp {

/** Corrects false connections between the key images of a component.
 *
 *  Things that occur twice in a scene join two places by matches that no test of a pair can tell
 *  from true ones, and images that were registered by way of them carry on from a wrong place.
 *  Where they meet images that see the same, many matches contradict the poses and the few false
 *  ones alone agree with them. The maximum spanning tree of the images, by number of matches, shows
 *  this: where one of its edges is contradicted, the images were joined by weaker edges than they
 *  might be. The smaller of the parts that such an edge connects moves to where the edge puts it if
 *  the parts share more points then. Points count, not matches: one thing, seen in many images, is
 *  weak evidence.
 *
 *  When images were moved, the tracks of the component are built anew.
 *  \return number of images that were moved. */
std::size_t
correctFalseConnections(const ImageGraph& graph, int component, const TrackOptions& options,
                        int num_threads, SparseModel& model);

} // namespace bundle_icp
