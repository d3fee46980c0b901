// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/graph/features.h>

#include <opencv2/core/types.hpp>

#include <functional>
#include <vector>

namespace bundle_icp {

/** Finds the features of a frame in place of extractFeatures(), see
 *  ReconstructionOptions::find_features. Several threads call it at once, each for another frame.
 *  The same frame must always give the same features. */
using FeatureFinder =
    std::function<Features(const RGBDFrame&, const CameraIntrinsics&, const FeatureOptions&)>;

/** Descriptors of any kind in the form of Features::descriptors: unit length, units of 1/256, at
 *  most 127, 128 numbers a row. Products of two rows are then as those of the given ones.
 *
 *  Of up to 128 numbers none of which is negative, as SIFT's, each keeps its place. Signed ones are
 *  folded to 64 numbers with fixed signs where they are more, which keeps products on average, and
 *  then divided into positive and negative parts. A number that holds more than half of its row's
 *  length is cut. SIFT matches better as RootSIFT: give the square root of its numbers.
 *  \param descriptors N x D, CV_32FC1 of any length, or CV_8UC1: binary ones, as ORB has them, with
 *  D bytes of 8 bits
 *  \return N x 128, CV_8UC1
 *  \throws pcl::BadArgumentException for another type, or a number that is not finite. */
BUNDLE_ICP_EXPORT cv::Mat
toDescriptors(const cv::Mat& descriptors);

/** Features from the keypoints of any detector: measures their depth as extractFeatures() does, and
 *  sorts them, so that their order does not matter. The position has a standard deviation of
 *  FeatureOptions::pixel_sigma, or more where cv::KeyPoint::size says that the keypoint is coarse:
 *  sqrt(size / 4 px) times as much. A detector whose size is a patch around the keypoint should set
 *  it to 4 px times the scale.
 *  \param keypoints in pixels of the colour image, all of them inside; at most
 *  FeatureOptions::max_features are advisable
 *  \param descriptors one row a keypoint, as toDescriptors() gives them
 *  \throws pcl::BadArgumentException for invalid options, images of wrong type or size, keypoints
 *  outside the image, or descriptors of another number or form. */
BUNDLE_ICP_EXPORT Features
makeFeatures(const std::vector<cv::KeyPoint>& keypoints, const cv::Mat& descriptors,
             const RGBDFrame& frame, const CameraIntrinsics& camera,
             const FeatureOptions& options = {});

} // namespace bundle_icp
