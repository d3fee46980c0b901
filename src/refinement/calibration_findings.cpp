// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/format_text.h"
#include "refinement/verification.h"

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

using P = CalibrationParameter;

Finding
focalLength(double x, double y, const CameraIntrinsics& camera)
{
  const double fx = camera.fx * (1 + x), fy = camera.fy * (1 + y);
  return {Severity::FAULT,
          "focal_length",
          formatText("the data want a focal length of about %.0f, %.0f px instead of %.0f, %.0f px "
                     "(%+.0f %%, %+.0f %%): more than an error of calibration",
                     fx, fy, camera.fx, camera.fy, 100 * x, 100 * y),
          {{"nominal_fx_px", camera.fx},
           {"nominal_fy_px", camera.fy},
           {"wanted_fx_px", fx},
           {"wanted_fy_px", fy}},
          "give the camera's true intrinsics by --intrinsics"};
}

Finding
otherCorrection(const CalibrationTest& test)
{
  Finding finding{Severity::WARNING,
                  "calibration",
                  "the data want a correction that no camera "
                  "has, which was not applied: " +
                      test.name,
                  {},
                  "check intrinsics and whether colour and depth belong together"};
  for (std::size_t i = 0; i < test.parameters.size(); ++i) {
    const char* name = calibrationName(test.parameters[i]);
    finding.what += formatText("%s%s %.3g", i == 0 ? " (" : ", ", name, test.implausible[i]);
    finding.evidence.emplace_back(name, test.implausible[i]);
  }
  finding.what += ")";
  return finding;
}

} // namespace

std::vector<Finding>
calibrationFindings(const SelfCalibrationResult& result, const Calibration& calibration,
                    const CameraIntrinsics& camera)
{
  std::vector<Finding> findings;
  for (const CalibrationTest& test : result.tests)
    if (!test.implausible.empty() && test.parameters.front() == P::FOCAL_X)
      findings.push_back(focalLength(test.implausible[0], test.implausible[1], camera));
    else if (!test.implausible.empty())
      findings.push_back(otherCorrection(test));
  // The adjustment of all frames refines what the test found with some of them.
  const auto& estimated = result.calibrated;
  const double x = calibration[P::FOCAL_X], y = calibration[P::FOCAL_Y];
  if (std::find(estimated.begin(), estimated.end(), P::FOCAL_X) != estimated.end() &&
      std::max(std::abs(x), std::abs(y)) >= largestCorrection(P::FOCAL_X, camera))
    findings.push_back(focalLength(x, y, camera));
  return findings;
}

} // namespace bundle_icp
