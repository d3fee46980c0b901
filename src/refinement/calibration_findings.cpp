// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/format_text.h"
#include "refinement/verification.h"

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

using P = CalibrationParameter;

constexpr const char* NOT_SQUARE =
    ": pixels that are not square; the camera turns too little to show both focal lengths";
constexpr const char* BEYOND = ": more than an error of calibration";
/** Deviations by which a wanted focal length differs from the nominal one: may be so, is so. The
 *  deviation comes from four parts of the scan: 95 % and 99 % of Student's t with three degrees of
 *  freedom. */
constexpr double SOME_DEVIATIONS = 3.2, MANY_DEVIATIONS = 5.8;
/** Deviations by which it may be farther away. */
constexpr double MAX_DEVIATIONS = 2;
/** Smaller errors hardly change the poses; from the larger one on they do in any case. */
constexpr double SMALL_ERROR = 0.02, LARGE_ERROR = 0.03;

Finding
focalLength(Severity severity, double x, double y, const CameraIntrinsics& camera,
            const std::string& remark)
{
  const double fx = camera.fx * (1 + x), fy = camera.fy * (1 + y);
  return {severity,
          "focal_length",
          formatText("the data want a focal length of about %.0f, %.0f px instead of %.0f, %.0f px "
                     "(%+.0f %%, %+.0f %%)",
                     fx, fy, camera.fx, camera.fy, 100 * x, 100 * y) +
              remark,
          {{"nominal_fx_px", camera.fx},
           {"nominal_fy_px", camera.fy},
           {"wanted_fx_px", fx},
           {"wanted_fy_px", fy}},
          "give the camera's true intrinsics by --intrinsics"};
}

/** What the focal length wants to be although it was not corrected, or was by less than 5 %. */
std::vector<Finding>
wantedFocalLength(const WantedFocalLength& wanted, bool is_corrected,
                  const CameraIntrinsics& camera)
{
  const double error = std::abs(wanted.mean()), deviation = wanted.deviation;
  const double limit = largestCorrection(P::FOCAL_X, camera);
  if (!(deviation > 0) || error < SOME_DEVIATIONS * deviation)
    return {};
  const bool is_beyond =
      error >= MANY_DEVIATIONS * deviation && error + MAX_DEVIATIONS * deviation >= limit;
  if (!is_beyond && (is_corrected || error < SMALL_ERROR))
    return {};
  Finding finding =
      focalLength(is_beyond ? Severity::FAULT : Severity::WARNING, wanted.x, wanted.y, camera,
                  formatText(", +- %.1f %%: ", 100 * deviation) +
                      (is_beyond ? "this may be more than an error of calibration"
                                 : "not applied, as other images do not confirm it"));
  finding.evidence.emplace_back("deviation_share", deviation);
  return {finding};
}

Finding
otherCorrection(const CalibrationTest& test)
{
  Finding finding{Severity::FAULT,
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
    if (!test.implausible.empty() && test.parameters.front() == P::FOCAL_X) {
      const double most = std::max(std::abs(test.implausible[0]), std::abs(test.implausible[1]));
      const bool is_beyond = most >= largestCorrection(P::FOCAL_X, camera);
      findings.push_back(focalLength(most >= LARGE_ERROR ? Severity::FAULT : Severity::WARNING,
                                     test.implausible[0], test.implausible[1], camera,
                                     is_beyond ? BEYOND : NOT_SQUARE));
    }
    else if (!test.implausible.empty())
      findings.push_back(otherCorrection(test));
  // The adjustment of all frames refines what the test found with some of them.
  const auto& estimated = result.calibrated;
  const double x = calibration[P::FOCAL_X], y = calibration[P::FOCAL_Y];
  const bool is_corrected =
      std::find(estimated.begin(), estimated.end(), P::FOCAL_X) != estimated.end();
  if (is_corrected && std::max(std::abs(x), std::abs(y)) >= largestCorrection(P::FOCAL_X, camera))
    findings.push_back(focalLength(Severity::FAULT, x, y, camera, BEYOND));
  const bool has_focal_length =
      std::any_of(findings.begin(), findings.end(),
                  [](const Finding& finding) { return finding.kind == "focal_length"; });
  if (!has_focal_length)
    for (const Finding& finding : wantedFocalLength(result.wanted_focal, is_corrected, camera))
      findings.push_back(finding);
  return findings;
}

} // namespace bundle_icp
