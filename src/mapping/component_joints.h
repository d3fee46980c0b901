// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "mapping/joint_evidence.h"
#include "mapping/part_shape.h"

#include <bundle_icp/mapping/incremental_mapper.h>

#include <map>
#include <optional>
#include <set>

namespace bundle_icp {

/** A joint that was made. */
struct MadeJoint {
  ComponentJoint report;
  int component = 0; ///< that the joint has made larger
  Part moved;        ///< the frames of the smaller part
};

/** Joins parts of a scan by the shape of their surfaces: components, and frames that are in none.
 *  Refers to its arguments. */
class ComponentJoiner {
public:
  ComponentJoiner(const ImageGraph& graph, const DepthViewProvider& depth_views,
                  const FrameRegistrar& registrar, const MapperOptions& options)
  : graph_(graph), depth_views_(depth_views), registrar_(registrar), options_(options)
  {
  }

  /** Makes the joint that depth supports most, to the largest component that has one: moves the
   *  smaller part into its world and joins their tracks. Unset when no joint is beyond doubt. */
  std::optional<MadeJoint>
  joinNext(SparseModel& model);

private:
  std::vector<Part>
  findParts(const SparseModel& model) const;
  std::optional<JointEvidence>
  findJoint(const SparseModel& model, const Part& first, const Part& second,
            double& runner_up_support);
  std::vector<JointEvidence>
  hypotheses(const SparseModel& model, const JointJudge& judge, const Part& first,
             const Part& second);
  void
  addMatchingMotions(const SparseModel& model, const Part& first, const Part& second,
                     std::vector<JointEvidence>& motions) const;
  const PartShape&
  shapeOf(const SparseModel& model, const Part& part);
  MadeJoint
  join(const Part& first, const Part& second, const JointEvidence& evidence,
       double runner_up_support, SparseModel& model) const;

  const ImageGraph& graph_;
  const DepthViewProvider& depth_views_;
  const FrameRegistrar& registrar_;
  const MapperOptions& options_;
  std::map<Part, PartShape> shapes_;
  std::set<std::pair<Part, Part>> refused_;
};

} // namespace bundle_icp
