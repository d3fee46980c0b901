// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/registration/visual_pose.h>

#include <bundle_icp/common/exceptions.h>

#include <cmath>
#include <string>

namespace bundle_icp {
bool
VisualPoseOptions::isValid(std::string* error) const
{
  if (min_inliers >= 3)
    return alignment.isValid(error);
  if (error)
    *error = "min_inliers must be >= 3";
  return false;
}

bool
isValid(const VisualCorrespondences& c, std::string* error)
{
  const auto fail = [error](const std::string& reason) {
    if (error)
      *error = "visual correspondences: " + reason;
    return false;
  };
  if (c.source.size() != c.target.size() || c.source.size() != c.weights.size())
    return fail(std::to_string(c.source.size()) + " source points, " +
                std::to_string(c.target.size()) + " target points and " +
                std::to_string(c.weights.size()) + " weights; expected equally many");
  for (std::size_t i = 0; i < c.source.size(); ++i) {
    if (!c.source[i].allFinite() || !c.target[i].allFinite())
      return fail("point " + std::to_string(i) + " is not finite");
    if (!std::isfinite(c.weights[i]) || c.weights[i] <= 0)
      return fail("weight " + std::to_string(i) + " is " + std::to_string(c.weights[i]) +
                  "; expected a positive number");
  }
  return true;
}

std::optional<RigidAlignment>
estimateVisualPose(const VisualCorrespondences& correspondences, const VisualPoseOptions& options)
{
  std::string error;
  if (!options.isValid(&error) || !isValid(correspondences, &error))
    throw BadArgumentException("estimateVisualPose: " + error);
  if (correspondences.source.size() < options.min_inliers)
    return std::nullopt;
  std::vector<PointPair> pairs;
  for (std::size_t i = 0; i < correspondences.source.size(); ++i)
    pairs.push_back(
        {correspondences.source[i], correspondences.target[i], correspondences.weights[i]});
  RigidAlignment found = robustRigidAlignment(pairs, options.alignment);
  if (!found.success || found.inliers.size() < options.min_inliers)
    return std::nullopt;
  return found;
}

} // namespace bundle_icp
