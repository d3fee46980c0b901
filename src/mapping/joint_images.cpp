// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/joint_images.h"

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

constexpr double SQUARED_NORM = 256 * 256;
/** Of 1 - cosine of two descriptors. Of features of different points 6 % are as near, where a few
 *  may be chosen from. */
constexpr double MAX_DISTANCE = 0.1;
/** A motion may be off by so much of the width of the image, and by so much in depth [m]. */
constexpr double MAX_OFFSET = 0.02, MAX_DEPTH_DIFFERENCE = 0.1;
/** Cosine of the angle, and ratio of the distances, from which SIFT knows a feature again. */
constexpr double MIN_COSINE = 0.94, MAX_DISTANCE_RATIO = 1.5;

/** Whether a view measures about the depth of a point in its frame. */
bool
showsSurface(const DepthView& view, const Eigen::Vector3d& point)
{
  if (!(point.z() > 0))
    return false;
  const Eigen::Vector2d pixel = view.camera.project(point);
  const cv::Point nearest(cvRound(pixel.x()), cvRound(pixel.y()));
  return cv::Rect({}, view.depth.size()).contains(nearest) &&
         std::abs(view.depth.at<float>(nearest) - point.z()) < MAX_DEPTH_DIFFERENCE;
}

bool
seenAlike(const Eigen::Vector3d& from_first, const Eigen::Vector3d& from_second)
{
  const double first = from_first.norm(), second = from_second.norm();
  return from_first.dot(from_second) > MIN_COSINE * first * second &&
         std::max(first, second) < MAX_DISTANCE_RATIO * std::min(first, second);
}

/** \param pixel where `first` should show feature j of `second` */
void
lookFor(const Features& first, const Eigen::Vector2f& pixel, float radius, const Features& second,
        int j, ImageAgreement& agreement)
{
  bool is_expected = false, is_alike = false;
  for (int i = 0; i < first.descriptors.rows; ++i) {
    if ((first.pixels[i] - pixel).cwiseAbs().maxCoeff() > radius)
      continue;
    is_expected = true;
    const double cosine = first.descriptors.row(i).dot(second.descriptors.row(j)) / SQUARED_NORM;
    is_alike = is_alike || 1 - cosine < MAX_DISTANCE;
  }
  agreement.expected += is_expected;
  agreement.alike += is_alike;
}

} // namespace

ImageAgreement
compareImages(const ImageGraph& graph, const SparseModel& model,
              const DepthViewProvider& depth_views, const Part& first, const Part& second,
              const Pose& first_from_second)
{
  ImageAgreement agreement;
  const CameraIntrinsics& camera = graph.camera();
  const float radius = float(MAX_OFFSET * camera.width);
  for (const std::size_t a : first)
    for (const std::size_t b : second) {
      const Features &features_a = graph.features(a), &features_b = graph.features(b);
      const Pose a_from_b =
          model.worldFromCamera(a).inverse() * first_from_second * model.worldFromCamera(b);
      if (a_from_b.linear()(2, 2) < MIN_COSINE)
        continue;
      const auto view = depth_views(a, model);
      for (int j = 0; j < features_b.descriptors.rows; ++j) {
        if (!features_b.hasDepth(j))
          continue;
        const Eigen::Vector2f& of_b = features_b.pixels[j];
        const Eigen::Vector3d in_b = camera.unproject(of_b.x(), of_b.y(), features_b.depths[j]);
        const Eigen::Vector3d in_a = a_from_b * in_b;
        if (showsSurface(*view, in_a) && seenAlike(in_a, a_from_b.linear() * in_b))
          lookFor(features_a, camera.project(in_a).cast<float>(), radius, features_b, j, agreement);
      }
    }
  return agreement;
}

} // namespace bundle_icp
