// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "tables.h"

#include <opencv2/core/mat.hpp>

namespace bundle_icp {

/** ATE (logarithmic) and share of frames with a pose along an axis, CV_8UC3 BGR on
 * white. Hollow markers: fewer than nine tenths of the frames have a pose, so that the
 * ATE says little. \param conditions of curve() */
cv::Mat
plotCurve(const std::string& scan, const std::vector<ConditionResult>& conditions,
          Axis axis);

} // namespace bundle_icp
