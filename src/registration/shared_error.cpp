// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/shared_error.h"

#include <Eigen/Cholesky>
#include <opencv2/core.hpp>

#include <algorithm>

namespace bundle_icp {

Matrix6d
withSharedError(const Matrix6d& independent, const DepthView& view, const DepthNoise& noise,
                double shared_sigmas, int num_frames)
{
  const cv::Mat measured = view.depth == view.depth; // NaN differs from itself
  const double z = std::max(cv::mean(view.depth, measured)[0], 0.1);
  const SharedError shared(z, noise, shared_sigmas);
  Vector6d precision; // of n C
  precision << Eigen::Vector3d::Constant(1 / (shared.tilt * shared.tilt)),
      Eigen::Vector3d::Constant(1 / (shared.shift * shared.shift));
  precision /= num_frames;
  Matrix6d sum = independent;
  sum.diagonal() += precision;
  const Matrix6d result = independent - independent * sum.ldlt().solve(independent);
  return 0.5 * (result + result.transpose());
}

} // namespace bundle_icp
