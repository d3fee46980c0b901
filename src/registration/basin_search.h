// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "registration/alignment_terms.h"

namespace bundle_icp {

/** A pose that ICP leads to. */
struct Basin {
  Pose pose = Pose::Identity();
  /** Share of the source that lies on the target, times the share of agreement: 0 to 1. */
  double support = 0;
};

/** Whether two poses are one answer: within 5 cm and 3 degrees. */
bool
areAlike(const Pose& a, const Pose& b);

/** The poses of a source that ICP by projection finds from many starts, best first, no two alike.
 *  The starts lie about two poses, then about the best of what was found. The terms must have no
 *  visual evidence; their level changes.
 *  \param reach how far starts lie from where they were drawn about [m]; what lies three times as
 *  far from the first pose is not among the results */
std::vector<Basin>
findBasins(AlignmentTerms& terms, const Pose& first, const Pose& second, double reach);

} // namespace bundle_icp
