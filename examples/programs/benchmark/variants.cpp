// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "variants.h"

namespace bundle_icp {

using Method = ReconstructionMethod;
using Options = ReconstructionOptions;

const std::vector<Variant>&
comparedMethods()
{
  static const std::vector<Variant> methods{
      {"f2m_icp", "depth alone, tracked against the ray-cast volume (KinectFusion)",
       [](Options& o) { o.method = Method::F2M_ICP; }},
      {"visual_icp", "the same, started from features matched with the frame before",
       [](Options& o) { o.method = Method::VISUAL_ICP; }},
      {"rgbd_sfm",
       "structure from motion: measured depth, PnP, bundle adjustment (COLMAP with "
       "depth)",
       [](Options& o) { o.method = Method::RGBD_SFM; }},
      {"bundle_icp", "all visual evidence, then ICP against the virtual depth",
       [](Options& o) { o.method = Method::BUNDLE_ICP; }}};
  return methods;
}

const std::vector<Variant>&
ablations()
{
  static const std::vector<Variant> variants{
      {"no virtual depth", "bundle_icp with the visual pose only",
       [](Options& o) { o.mapper.registration.method = FrameRegistrationMethod::VISUAL; }},
      {"no visual start", "bundle_icp whose ICP starts from the best neighbour's pose",
       [](Options& o) { o.mapper.registration.visual_start = false; }},
      {"no global adjustment", "bundle_icp adjusted around each new image only",
       [](Options& o) { o.mapper.schedule.global_adjustment = false; }},
      {"no dense terms", "bundle_icp whose global adjustment sees features only",
       [](Options& o) { o.mapper.refinement.num_dense_neighbours = 0; }},
      {"no motion prior", "bundle_icp whose poses know nothing of their neighbours in time",
       [](Options& o) { o.mapper.refinement.motion_prior = false; }},
      {"no self-calibration", "bundle_icp with camera and depth as they come",
       [](Options& o) { o.mapper.refinement.self_calibration = false; }},
      {"no depth error of each image", "bundle_icp that corrects the camera only",
       [](Options& o) { o.mapper.refinement.calibration_test.depth_errors = false; }}};
  return variants;
}

} // namespace bundle_icp
