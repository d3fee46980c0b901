// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/finding.h>
#include <bundle_icp/refinement/frame_verdict.h>
#include <bundle_icp/refinement/self_calibration.h>
#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** What the other frames say of a frame's pose. */
struct VerifiedFrame {
  FrameVerdict verdict = FrameVerdict::LEFT_OUT;
  std::string doubt; ///< why the frame is doubtful
  /** The frame is doubtful even by the standards of a scan that is bad as a whole, and most of the
   *  scan is not: it is better without a pose. */
  bool refuted = false;
  /** Share of its depth that agrees with what others saw there, of that which agrees or lies in
   *  front of it, in either direction; unset when nothing was compared. */
  std::optional<double> depth_agreement;
  double displacement = 0; ///< median over its pairs, see displacementByMatches()
};

/** Outcome of verifyPoses(). */
struct Verification {
  std::vector<VerifiedFrame> frames; ///< by frame of the graph
  std::vector<Finding> findings;     ///< what follows for the scan
};

/** Says of final poses whether the evidence agrees with them: of each pair with many matches the
 *  relative pose, of each frame the depth that its neighbours saw. Frames that others contradict
 *  are taken out one by one, the worst first, so that a wrong frame does not speak against right
 *  ones. Thresholds follow from the depth noise and from the spread over the scan.
 *  \param depth_views gives the prepared view of a frame; several threads call it at once
 *  \param has_times whether the stamps are times, against which motion can be judged */
Verification
verifyPoses(const ImageGraph& graph, const SparseModel& model,
            const std::function<std::shared_ptr<const DepthView>(std::size_t)>& depth_views,
            bool has_times, int num_threads);

/** What self-calibration says of the camera that it was given. */
std::vector<Finding>
calibrationFindings(const SelfCalibrationResult& result, const Calibration& calibration,
                    const CameraIntrinsics& camera);

} // namespace bundle_icp
