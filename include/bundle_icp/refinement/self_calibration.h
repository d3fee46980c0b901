// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/adjustment/bundle_adjustment.h>

#include <string>
#include <vector>

namespace bundle_icp {

/** How selfCalibrate() works. */
struct BUNDLE_ICP_EXPORT SelfCalibrationOptions {
  /** True: corrections to the camera are tested. False: only the depth error of each frame is
   *  tested, for a camera that an earlier scan has calibrated. */
  bool camera = true;
  /** True: the test includes a DepthError of its own for each frame. */
  bool depth_errors = true;
  /** Maximum number of frames in the test, those that share most points. All give the final
   *  values. */
  std::size_t max_frames = 40;
  /** Minimum number of observations of a point: other points say little about the camera. */
  std::size_t min_track_length = 4;
  /** A correction is applied when it lowers the cost per frame of held-back observations by more
   *  than this many standard errors of the mean... */
  double significance = 3;
  /** ... and by more than this share. */
  double min_gain = 0.005;
  /** Minimum number of frames; with fewer nothing is tested. */
  std::size_t min_frames = 8;
  /** Iterations of each adjustment of the test. */
  int max_iterations = 6;
  /** Threads to use, 0 = all. */
  int num_threads = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** A correction that was tested: one or more parameters that only make sense together. */
struct CalibrationTest {
  std::string name;                             ///< "focal length", for example
  std::vector<CalibrationParameter> parameters; ///< empty: the DepthError of each frame
  bool applied = false;
  double gain = 0;         ///< share by which the cost of held-back observations fell
  double significance = 0; ///< mean of the gain per frame over the standard error of the mean
  /** Values of the parameters that the scan wants, but that no camera has against its nominal
   *  intrinsics: not applied, and no other correction after it. Empty = none. */
  std::vector<double> implausible;
};

/** What a scan says of the focal length, whether or not held-back observations notice: poses, depth
 *  errors and lens take up much of a wrong one, so that the cost hardly tells. */
struct WantedFocalLength {
  double x = 0, y = 0; ///< CalibrationParameter::FOCAL_X and FOCAL_Y, when the lens follows as well
  /** Standard deviation of their mean, from fits without a part of the frames each; 0 = not
   *  measured. */
  double deviation = 0;

  double
  mean() const
  {
    return 0.5 * (x + y);
  }
};

/** Largest correction of a parameter that is still one: beyond it the nominal camera is wrong. A
 *  focal length may be corrected by less than 5 %. */
BUNDLE_ICP_EXPORT double
largestCorrection(CalibrationParameter parameter, const CameraIntrinsics& camera);

/** Result of selfCalibrate(). */
struct SelfCalibrationResult {
  std::vector<CalibrationTest> tests;           ///< all corrections, applied or not
  std::vector<CalibrationParameter> calibrated; ///< parameters of the applied corrections
  bool depth_errors = false;                    ///< each frame has a DepthError of its own
  WantedFocalLength wanted_focal;
};

/** Finds the corrections that the scan supports. One after the other, the correction is added that
 *  best predicts held-back observations, as long as its gain is significant. A correction beyond
 *  largestCorrection(), or one that makes square pixels oblong by 2 %, ends the search and is not
 *  applied; one that is 0 within its deviations is dropped. Afterwards the model holds the
 *  calibration fitted to the frames that took part, with its deviations. adjustBundle() with the
 *  result refines the calibration with all frames, beyond these deviations.
 *  \param frames that may take part; their motions in the model must be set
 *  \throws pcl::BadArgumentException for invalid options */
BUNDLE_ICP_EXPORT SelfCalibrationResult
selfCalibrate(const ImageGraph& graph, const std::vector<std::size_t>& frames,
              const BundleAdjustmentOptions& adjustment, const SelfCalibrationOptions& options,
              SparseModel& model);

} // namespace bundle_icp
