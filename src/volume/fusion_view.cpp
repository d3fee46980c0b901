// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/fusion_view.h"

namespace bundle_icp {

FusionView
makeFusionView(const DepthSamples& samples, const Eigen::Matrix3d& image_from_world,
               const TSDFOptions& options, const ColorCorrection& correction)
{
  FusionView view{};
  view.depth = samples.depth.data();
  view.weight = samples.weight.data();
  view.color = samples.color.empty() ? nullptr : samples.color.data();
  view.color_weight = correction.weight;
  for (int channel = 0; channel < 3; ++channel)
    view.gain[channel] = correction.gain[channel];
  view.width = samples.camera.width;
  view.height = samples.camera.height;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < 3; ++i)
      view.step[axis][i] = float(image_from_world(i, axis) * options.voxel_size);
  view.voxel_size = float(options.voxel_size);
  view.truncation = float(options.truncation);
  view.inverse_truncation = 1 / view.truncation;
  view.min_depth = float(options.min_depth);
  view.sigma = DepthSigma(samples.camera.depth_noise);
  view.edges = DepthEdges(samples.camera);
  return view;
}

} // namespace bundle_icp
