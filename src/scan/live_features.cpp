// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/live_features.h"

#include <opencv2/imgproc.hpp>

namespace bundle_icp {

cv::Mat
thumbnailOf(const cv::Mat& color)
{
  cv::Mat small, gray, thumbnail;
  cv::resize(color, small, {40, 30}, 0, 0, cv::INTER_AREA);
  cv::cvtColor(small, gray, cv::COLOR_BGR2GRAY);
  gray.convertTo(thumbnail, CV_32F);
  cv::GaussianBlur(thumbnail, thumbnail, {0, 0}, 1.5);
  thumbnail -= cv::mean(thumbnail)[0];
  if (const double norm = cv::norm(thumbnail); norm > 0)
    thumbnail /= norm;
  return thumbnail;
}

VisualMatches
matchWithKnown(const Features& features, const std::vector<KnownFeatures>& known,
               const CameraIntrinsics& camera, const MatchingOptions& options,
               std::size_t min_inliers)
{
  VisualMatches found;
  for (const KnownFeatures& other : known) {
    const FramePair pair =
        verifyMatches(*other.features, features,
                      matchDescriptors(other.features->descriptors, features.descriptors, options),
                      camera, options);
    for (const FeatureMatch& match : pair.matches) {
      found.points.source.push_back(pointInCamera(features, std::size_t(match.second), camera));
      found.points.target.push_back(
          other.world_from_camera *
          pointInCamera(*other.features, std::size_t(match.first), camera));
      found.points.weights.push_back(
          1 / (pointVariance(features, std::size_t(match.second), camera) +
               pointVariance(*other.features, std::size_t(match.first), camera)));
    }
  }
  found.pose = estimateVisualPose(found.points);
  if (found.pose && found.pose->inliers.size() < min_inliers)
    found.pose.reset();
  return found;
}

} // namespace bundle_icp
