// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/pose_prior_findings.h"

#include "refinement/format_text.h"

#include <cmath>
#include <string>

namespace bundle_icp {
namespace {

/** A prior whose errors are more than so many times its deviations contradicts the data. */
constexpr double MANY_DEVIATIONS = 3;
/** So does one of which a larger share of motions is left out; by chance 0.5 % are. */
constexpr double LARGE_SHARE = 0.1;

/** What of the prior was not used, because its errors are as large as the motion. */
std::string
unusedPart(const PosePriorReport& prior)
{
  if (prior.uses_position && prior.uses_rotation)
    return {};
  const std::string part = prior.uses_position   ? "its rotation is"
                           : prior.uses_rotation ? "its position is"
                                                 : "it is";
  return "; " + part + " not used, as its errors are as large as the motion";
}

} // namespace

std::vector<Finding>
posePriorFindings(const PosePriorReport& prior)
{
  if (prior.frames == 0)
    return {};
  if (prior.motions == 0)
    return {{Severity::WARNING,
             "pose_prior",
             formatText("the prior poses of %zu frames are not used: no two key frames that follow "
                        "each other in time have one, the stamps do not tell their order, or there "
                        "is no global adjustment",
                        prior.frames),
             {{"frames", double(prior.frames)}},
             "a prior with a pose for each frame"}};
  const double to_degrees = 180 / M_PI;
  const bool is_contradicted = prior.measured_position > MANY_DEVIATIONS * prior.said_position ||
                               prior.measured_rotation > MANY_DEVIATIONS * prior.said_rotation ||
                               double(prior.left_out) > LARGE_SHARE * double(prior.motions);
  const std::string what =
      formatText("%zu frames have a prior pose, whose motion deviates from the data by %.2g m and "
                 "%.2g degrees a frame (said: %.2g m, %.2g degrees); %zu of %zu motions contradict "
                 "the data and are left out",
                 prior.frames, prior.measured_position, to_degrees * prior.measured_rotation,
                 prior.said_position, to_degrees * prior.said_rotation, prior.left_out,
                 prior.motions) +
      unusedPart(prior);
  return {{is_contradicted ? Severity::WARNING : Severity::NOTE,
           "pose_prior",
           what,
           {{"frames", double(prior.frames)},
            {"motions", double(prior.motions)},
            {"left_out", double(prior.left_out)},
            {"measured_position_m", prior.measured_position},
            {"said_position_m", prior.said_position},
            {"measured_rotation_degrees", to_degrees * prior.measured_rotation},
            {"said_rotation_degrees", to_degrees * prior.said_rotation}},
           is_contradicted ? "check that its times are those of the frames and its poses those of "
                             "the colour camera (x right, y down, z forward), or say its true SIGMA"
                           : ""}};
}

} // namespace bundle_icp
