// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/scan/scan_session.h>

namespace bundle_icp {

const char*
toString(LiveStatus status)
{
  return status == LiveStatus::GOOD ? "good" : status == LiveStatus::DOUBTFUL ? "doubtful" : "lost";
}

bool
ScanSessionOptions::isValid(std::string* error) const
{
  std::string reason;
  if (reconstruction.method != ReconstructionMethod::BUNDLE_ICP)
    reason = "a session works by bundle_icp alone; method is " + toString(reconstruction.method);
  else if (reconstruction.moving != MovingPart::CAMERA)
    reason = "a session needs a camera that moves, not an object";
  else if (reconstruction.poses)
    reason = "a session finds its poses; none may be given";
  else if (max_views < 1 || max_views > 20)
    reason = "max_views must lie in 1 ... 20";
  else if (!(cloud_spacing >= 0.001 && cloud_spacing <= 1))
    reason = "cloud_spacing must lie in 0.001 ... 1 m";
  else
    reconstruction.isValid(&reason);
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

} // namespace bundle_icp
