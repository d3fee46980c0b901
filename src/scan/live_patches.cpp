// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/live_patches.h"

#include "model/measurement_model.h"

#include <Eigen/Cholesky>
#include <opencv2/imgproc.hpp>

#include <array>
#include <cmath>
#include <optional>

namespace bundle_icp {
namespace {

/** Size of the full image over that of the PatchImages. */
constexpr int REDUCTIONS[] = {4, 2};
/** Half of the side of a patch, and pixels of a patch. */
constexpr int RADIUS = 4, SIDE = 2 * RADIUS + 1, PIXELS = SIDE * SIDE;
/** Points of one key frame that are looked for at most. */
constexpr std::size_t MOST_POINTS = 120;
/** A patch moves by at most so much from where it is expected [px], within so many steps. */
constexpr double FARTHEST = 4, SETTLED = 0.03;
constexpr int MAX_STEPS = 10;
/** Contrast that holds a patch in its weakest direction: mean squared gradient [grey levels^2]. */
constexpr double MIN_CONTRAST = 10;
/** Largest RMS difference of a found patch, as a share of the patch's own contrast. */
constexpr double LARGEST_DIFFERENCE = 0.5;
/** Standard deviation of a found point [px of the full image], with the error of the point. */
constexpr double PIXEL_SIGMA = 0.7;
/** Points within so many sigma agree with a pose. */
constexpr double INLIER_SIGMAS = 4;
constexpr int POSE_STEPS = 6;

/** A patch with its gradients, both in its own frame. */
struct Patch {
  std::array<float, PIXELS> value, by_x, by_y;
  Eigen::Matrix2d inverse; ///< of the sum of squared gradients
  double contrast = 0;     ///< standard deviation of the values
};

float
at(const cv::Mat& image, float x, float y)
{
  const int u = int(x), v = int(y);
  const float a = x - float(u), b = y - float(v);
  const std::uint8_t* const upper = image.ptr(v) + u;
  const std::uint8_t* const lower = image.ptr(v + 1) + u;
  return (1 - b) * ((1 - a) * upper[0] + a * upper[1]) + b * ((1 - a) * lower[0] + a * lower[1]);
}

bool
isInside(const cv::Mat& image, const Eigen::Vector2d& center, double reach)
{
  return center.x() >= reach && center.y() >= reach && center.x() < image.cols - 1 - reach &&
         center.y() < image.rows - 1 - reach;
}

/** Position in a reduced image of a pixel of the full image. */
Eigen::Vector2d
reduced(const Eigen::Vector2d& pixel, double reduction)
{
  return ((pixel.array() + 0.5) / reduction - 0.5).matrix();
}

std::optional<Patch>
cutPatch(const cv::Mat& image, const Eigen::Vector2d& center)
{
  if (!isInside(image, center, RADIUS + 2))
    return std::nullopt;
  Patch patch;
  double sum = 0, squared = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d gradients = Eigen::Matrix2d::Zero();
  for (int j = 0, k = 0; j < SIDE; ++j)
    for (int i = 0; i < SIDE; ++i, ++k) {
      const float x = float(center.x()) + float(i - RADIUS);
      const float y = float(center.y()) + float(j - RADIUS);
      patch.value[k] = at(image, x, y);
      patch.by_x[k] = 0.5f * (at(image, x + 1, y) - at(image, x - 1, y));
      patch.by_y[k] = 0.5f * (at(image, x, y + 1) - at(image, x, y - 1));
      const Eigen::Vector2d gradient(patch.by_x[k], patch.by_y[k]);
      gradients += gradient * gradient.transpose();
      mean += gradient;
      sum += patch.value[k];
      squared += double(patch.value[k]) * patch.value[k];
    }
  gradients -= mean * mean.transpose() / PIXELS; // brightness is free
  const double half = 0.5 * gradients.trace();
  const double smallest = half - std::sqrt(std::max(0.0, half * half - gradients.determinant()));
  if (smallest < MIN_CONTRAST * PIXELS)
    return std::nullopt;
  for (int k = 0; k < PIXELS; ++k) {
    patch.value[k] -= float(sum / PIXELS);
    patch.by_x[k] -= float(mean.x() / PIXELS);
    patch.by_y[k] -= float(mean.y() / PIXELS);
  }
  patch.contrast = std::sqrt(std::max(0.0, squared / PIXELS - (sum / PIXELS) * (sum / PIXELS)));
  patch.inverse = gradients.inverse();
  return patch;
}

/** Where an image shows a patch, starting at `center`; unset when it does not.
 *  \param image_from_patch how directions of the patch lie in the image */
std::optional<Eigen::Vector2d>
follow(const Patch& patch, const cv::Mat& image, const Eigen::Vector2d& center,
       const Eigen::Matrix2d& image_from_patch)
{
  const double reach = std::ceil(RADIUS * 1.5 + 1);
  Eigen::Vector2d found = center;
  for (int step = 0; step < MAX_STEPS; ++step) {
    if (!isInside(image, found, reach) || (found - center).norm() > FARTHEST)
      return std::nullopt;
    std::array<float, PIXELS> value;
    float mean = 0;
    for (int j = 0, k = 0; j < SIDE; ++j)
      for (int i = 0; i < SIDE; ++i, ++k) {
        const Eigen::Vector2d at_pixel =
            found + image_from_patch * Eigen::Vector2d(i - RADIUS, j - RADIUS);
        value[k] = at(image, float(at_pixel.x()), float(at_pixel.y()));
        mean += value[k] / PIXELS;
      }
    Eigen::Vector2d slope = Eigen::Vector2d::Zero();
    double squared = 0;
    for (int k = 0; k < PIXELS; ++k) {
      const float difference = value[k] - mean - patch.value[k];
      slope += difference * Eigen::Vector2d(patch.by_x[k], patch.by_y[k]);
      squared += double(difference) * difference;
    }
    const Eigen::Vector2d move = image_from_patch * (patch.inverse * slope);
    if (move.norm() < SETTLED)
      return std::sqrt(squared / PIXELS) < LARGEST_DIFFERENCE * patch.contrast
                 ? std::make_optional(found)
                 : std::nullopt;
    found -= move;
  }
  return std::nullopt;
}

/** Pixel of a point in the world, with the row of the shutter that it shows in. */
Eigen::Vector2d
pixelOf(const MeasurementModel& model, const Eigen::Vector3d& point, double middle_row,
        Eigen::Matrix<double, 2, 3>* by_point = nullptr)
{
  const double row = model.pixel(point, middle_row).y();
  return model.pixel(point, row, by_point);
}

} // namespace

PatchImages
patchImages(const cv::Mat& color)
{
  PatchImages images;
  cv::Mat small;
  cv::resize(color, small, color.size() / REDUCTIONS[1], 0, 0, cv::INTER_AREA);
  cv::cvtColor(small, images[1], cv::COLOR_BGR2GRAY);
  cv::resize(images[1], images[0], color.size() / REDUCTIONS[0], 0, 0, cv::INTER_AREA);
  return images;
}

std::vector<SeenPoint>
findPatches(const PatchSource& source, const cv::Mat& image, const MovingCamera& camera,
            const Pose& world_from_camera)
{
  const MeasurementModel model(camera.camera, camera.calibration, camera.motion);
  const double middle = 0.5 * camera.camera.height;
  const Pose source_from_world = source.world_from_camera.inverse();
  const Pose camera_from_world = world_from_camera.inverse();
  const Pose camera_from_source = camera_from_world * source.world_from_camera;
  const double reduction = double(camera.camera.width) / image.cols;
  const std::size_t count = source.points->size();
  const std::size_t step = std::max<std::size_t>(1, count / MOST_POINTS);
  std::vector<SeenPoint> seen;
  for (std::size_t j = 0; j < count; j += step) {
    const Eigen::Vector3d point = (*source.points)[j].cast<double>();
    const Eigen::Vector3d p = camera_from_world * point, q = source_from_world * point;
    if (!point.allFinite() || !(p.z() > 0.05 && q.z() > 0.05))
      continue;
    const Eigen::Vector2d expected = pixelOf(model, p, middle);
    if (!camera.camera.contains(expected))
      continue;
    // A patch of the plane through the point that faces the key frame.
    Eigen::Matrix2d image_from_patch;
    for (int axis = 0; axis < 2; ++axis) {
      const double length = reduction * q.z() / (axis == 0 ? camera.camera.fx : camera.camera.fy);
      const Eigen::Vector3d beside = q + length * Eigen::Vector3d::Unit(axis);
      image_from_patch.col(axis) =
          reduced(pixelOf(model, camera_from_source * beside, middle), reduction) -
          reduced(expected, reduction);
    }
    const double scale = image_from_patch.determinant();
    if (!(scale > 0.5 && scale < 2))
      continue;
    const std::optional<Patch> patch =
        cutPatch(source.image, reduced((*source.pixels)[j].cast<double>(), reduction));
    if (!patch)
      continue;
    if (const auto found = follow(*patch, image, reduced(expected, reduction), image_from_patch))
      seen.push_back({point, ((found->array() + 0.5) * reduction - 0.5).matrix()});
  }
  return seen;
}

PatchPose
poseFromPatches(const std::vector<SeenPoint>& seen, const MovingCamera& camera, const Pose& start,
                const Pose& other, const Matrix6d& information)
{
  const MeasurementModel model(camera.camera, camera.calibration, camera.motion);
  PatchPose pose;
  // Rotation and translation of increment() are apart, so that of a product is a sum nearly.
  Vector6d moved = Vector6d::Zero();
  moved.head<3>() = logarithm(start * other.inverse()).head<3>();
  moved.tail<3>() = start.translation() - increment(moved).linear() * other.translation();
  for (int step = 0; step < POSE_STEPS; ++step) {
    pose.world_from_camera = increment(moved) * other;
    const Pose camera_from_world = pose.world_from_camera.inverse();
    pose.information = information;
    pose.inliers = 0;
    Vector6d slope = information * moved;
    for (const SeenPoint& point : seen) {
      Eigen::Matrix<double, 2, 3> by_point;
      const Eigen::Vector3d p = camera_from_world * point.point;
      const Eigen::Vector2d error =
          (model.pixel(p, point.pixel.y(), &by_point) - point.pixel) / PIXEL_SIGMA;
      Eigen::Matrix<double, 3, 6> by_motion;
      by_motion << camera_from_world.linear() * crossMatrix(point.point),
          -camera_from_world.linear();
      const Eigen::Matrix<double, 2, 6> row = by_point * by_motion / PIXEL_SIGMA;
      const double weight = 1 / (1 + error.squaredNorm() / 4); // Cauchy's
      pose.information += weight * row.transpose() * row;
      slope += weight * row.transpose() * error;
      pose.inliers += error.norm() < INLIER_SIGMAS;
    }
    Matrix6d damped = pose.information;
    damped.diagonal().array() += 1;
    moved -= damped.ldlt().solve(slope);
  }
  pose.world_from_camera = increment(moved) * other;
  return pose;
}

} // namespace bundle_icp
