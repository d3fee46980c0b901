// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/adjustment/bundle_adjustment.h>

#include <string>
#include <vector>

namespace bundle_icp {

/** How selfCalibrate() works. */
struct BUNDLE_ICP_EXPORT SelfCalibrationOptions {
  /** Whether corrections to the camera are tested, or only the depth error of each image: false
   *  for a camera that is known from an earlier scan. */
  bool camera = true;
  /** Whether it is tested that each image has a DepthError of its own. */
  bool depth_errors = true;
  /** Images that take part in the test, those that share most points. The values are
   *  then estimated from all. */
  std::size_t max_images = 40;
  /** Points seen less often say little about the camera. */
  std::size_t min_track_length = 4;
  /** A correction is applied when it lowers the cost of observations that were held back, per
   *  image, by more than this many standard errors of the mean... */
  double significance = 3;
  /** ... and by more than this share. */
  double min_gain = 0.005;
  /** Fewer images are too few to tell. */
  std::size_t min_images = 8;
  /** Iterations of each adjustment of the test. */
  int max_iterations = 6;
  /** Threads to use, 0 = all. */
  int num_threads = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** A correction that was tested: parameters that only make sense together. */
struct CalibrationTest {
  std::string name;                             ///< "focal length", for example
  std::vector<CalibrationParameter> parameters; ///< none: the DepthError of each image
  bool applied = false;
  double gain = 0;         ///< share by which it lowered the cost of held-back observations
  double significance = 0; ///< mean of the gain per image over its standard error
};

/** What selfCalibrate() decided. */
struct SelfCalibrationResult {
  std::vector<CalibrationTest> tests;           ///< all corrections, applied or not
  std::vector<CalibrationParameter> calibrated; ///< parameters of those applied
  bool depth_errors = false;                    ///< each image has a DepthError of its own
};

/** Finds out which corrections the scan supports: one after the other, that one is added which
 *  best predicts observations that were held back, as long as it does so significantly. Afterwards
 *  the model holds the calibration fitted to the images that took part, with its deviations;
 *  adjustBundle() with the result refines it with all images, beyond these deviations.
 *  \param images that may take part; motions of the model must be set
 *  \throws pcl::BadArgumentException for invalid options */
BUNDLE_ICP_EXPORT SelfCalibrationResult
selfCalibrate(const ImageGraph& graph, const std::vector<std::size_t>& images,
              const BundleAdjustmentOptions& adjustment, const SelfCalibrationOptions& options,
              SparseModel& model);

} // namespace bundle_icp
