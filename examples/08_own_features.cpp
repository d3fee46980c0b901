// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Features of one's own in place of SIFT: here those of ORB (Rublee et al., ICCV 2011).
//
//   bundle_icp_example_own_features SCAN
#include <bundle_icp/reconstruction.h>

#include <opencv2/features2d.hpp>

#include <iostream>

bundle_icp::Features
findOrb(const bundle_icp::RGBDFrame& frame, const bundle_icp::CameraIntrinsics& camera,
        const bundle_icp::FeatureOptions& options)
{
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat bits;
  cv::ORB::create(options.max_features)
      ->detectAndCompute(frame.color, cv::noArray(), keypoints, bits);
  for (cv::KeyPoint& keypoint : keypoints)
    keypoint.size *= 4.0f / 31; // the size is that of a patch of 31 px at the finest scale
  return bundle_icp::makeFeatures(keypoints, bundle_icp::toDescriptors(bits), frame, camera,
                                  options);
}

int
main(int argc, char** argv)
{
  if (argc != 2)
    return 2;
  bundle_icp::ReconstructionOptions options;
  options.find_features = findOrb;
  std::cout << bundle_icp::reconstruct(*bundle_icp::openDataset(argv[1]), options).summary()
            << '\n';
}
