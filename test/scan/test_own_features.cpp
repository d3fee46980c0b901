// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// ReconstructionOptions::find_features: features that the application brings.
#include "messages.h"
#include "scan/frames.h"

#include <opencv2/features2d.hpp>

#include <limits>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

ReconstructionResult
reconstructWith(const FeatureFinder& finder)
{
  ReconstructionOptions options = withoutMesh();
  options.find_features = finder;
  return reconstruct(Frames(everyFourth()), options);
}

Features
findOrb(const RGBDFrame& frame, const CameraIntrinsics& camera, const FeatureOptions& options)
{
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat bits;
  cv::ORB::create(options.max_features)
      ->detectAndCompute(frame.color, cv::noArray(), keypoints, bits);
  for (cv::KeyPoint& keypoint : keypoints)
    keypoint.size *= 4.0f / 31;
  return makeFeatures(keypoints, toDescriptors(bits), frame, camera, options);
}

/** SIFT in all frames, spoilt in one. */
FeatureFinder
spoiltInOne(const std::function<void(Features&)>& spoil)
{
  return [spoil](const RGBDFrame& frame, const CameraIntrinsics& camera,
                 const FeatureOptions& options) {
    Features features = extractFeatures(frame, camera, options);
    if (frame.id == 8)
      spoil(features);
    return features;
  };
}

} // namespace

TEST(OwnFeatures, OnesLikeTheLibrarysGiveTheSameResult)
{
  const ReconstructionResult result = reconstructWith(
      [](const RGBDFrame& frame, const CameraIntrinsics& camera, const FeatureOptions& options) {
        return extractFeatures(frame, camera, options);
      });
  ASSERT_EQ(result.frames.size(), reference().frames.size());
  for (std::size_t i = 0; i < result.frames.size(); ++i)
    EXPECT_EQ(result.frames[i].world_from_camera.matrix(),
              reference().frames[i].world_from_camera.matrix());
}

TEST(OwnFeatures, OrbFindsTheTruePoses)
{
  const ReconstructionResult result = reconstructWith(findOrb);
  EXPECT_EQ(result.component_sizes, std::vector<std::size_t>{8});
  EXPECT_LT(largestError(result), 0.01);
}

TEST(OwnFeatures, WrongOnesAreThatFramesReason)
{
  const std::pair<std::function<void(Features&)>, const char*> faults[] = {
      {[](Features&) { throw std::runtime_error("the network is gone"); },
       "find_features failed: the network is gone"},
      {[](Features& f) { f.pixels[3].x() = 320; },
       "wrong features: feature 3: its position lies outside the image"},
      {[](Features& f) { f.pixels[4].y() = std::numeric_limits<float>::quiet_NaN(); },
       "feature 4: its position lies outside the image"},
      {[](Features& f) { f.pixel_sigmas[0] = 0; },
       "feature 0: the deviation of its position must be positive"},
      {[](Features& f) { f.depths[0] = std::numeric_limits<float>::infinity(); },
       "feature 0: its depth is infinite"},
      {[](Features& f) {
         f.depths[0] = 1;
         f.depth_sigmas[0] = 0;
       },
       "feature 0: the deviation of its depth must be positive"},
      {[](Features& f) { f.colors.pop_back(); }, "differ in number"},
      {[](Features& f) { f.descriptors = f.descriptors.rowRange(0, 5); }, "differ in number"},
      {[](Features& f) { f.descriptors.convertTo(f.descriptors, CV_32F); },
       "the descriptors are 128 numbers of type CV_32FC1; they must be 128 of CV_8UC1"},
      {[](Features& f) { f.descriptors.at<std::uint8_t>(0, 0) = 128; },
       "a descriptor holds a number above 127"},
      {[](Features& f) { f.sharpness = -1; }, "the sharpness must be finite"}};
  for (const auto& [spoil, reason] : faults) {
    const ReconstructionResult result = reconstructWith(spoiltInOne(spoil));
    EXPECT_EQ(result.component_sizes, std::vector<std::size_t>{7}) << reason;
    EXPECT_FALSE(result.frames[2].registered);
    EXPECT_CONTAINS(result.frames[2].reason, "frame 8: find_features ");
    EXPECT_CONTAINS(result.frames[2].reason, reason);
  }
}

TEST(OwnFeatures, WhereTheyFailNothingIsTrackedByDepthAlone)
{
  ReconstructionOptions options = withoutMesh();
  options.method = ReconstructionMethod::VISUAL_ICP;
  options.find_features = spoiltInOne([](Features&) { throw std::runtime_error("gone"); });
  const ReconstructionResult result = reconstruct(Frames(everyFourth()), options);
  EXPECT_FALSE(result.frames[2].registered);
  EXPECT_CONTAINS(result.frames[2].reason, "find_features failed: gone");
}

TEST(OwnFeatures, FramesMayHaveNone)
{
  const ReconstructionResult result = reconstructWith(spoiltInOne([](Features& f) { f = {}; }));
  EXPECT_EQ(result.frames[2].features, 0u);
  EXPECT_GE(result.component_sizes.at(0), 7u);
  EXPECT_LT(largestError(result), 0.01);
}
