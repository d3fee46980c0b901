// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/preview.h"

#include "common/concatenate.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

constexpr int SUPERSAMPLING = 2;
const Eigen::Array2f PICTURE_SIZE = SUPERSAMPLING * Eigen::Array2f(1280, 960);
constexpr float FOCAL_LENGTH = SUPERSAMPLING * 1050;

/** Camera of drawMesh() that chooses its view. */
CameraIntrinsics
pictureCamera()
{
  CameraIntrinsics camera;
  camera.width = int(PICTURE_SIZE.x());
  camera.height = int(PICTURE_SIZE.y());
  camera.fx = camera.fy = FOCAL_LENGTH;
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  return camera;
}

/** A vertex in the picture. */
struct Corner {
  Eigen::Vector2f pixel;
  float inverse_depth = 0; ///< 0 = behind the camera
  Eigen::Vector3f color;   ///< BGR, shaded
};

/** A camera at the mean of the cameras that looks where they looked on average. */
Pose
meanView(const std::vector<Pose>& world_from_cameras)
{
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), down = center, forward = center;
  for (const Pose& pose : world_from_cameras) {
    center += pose.translation();
    down += pose.linear().col(1);
    forward += pose.linear().col(2);
  }
  const double count = double(world_from_cameras.size());
  const Eigen::Matrix3d& first = world_from_cameras.front().linear();
  if (down.norm() < 0.1 * count)
    down = first.col(1);
  if (forward.norm() < 0.4 * count) // all around: from above
    forward = first.col(2) + down.normalized();
  Pose view = Pose::Identity();
  view.translation() = center / count;
  const Eigen::Vector3d z = forward.normalized();
  Eigen::Vector3d x = down.cross(z);
  if (x.norm() < 1e-6 * down.norm())
    x = z.unitOrthogonal();
  view.linear() << x.normalized(), z.cross(x.normalized()), z;
  return view;
}

/** Offset of the plane sign * x = tangent * z (y for axis 1) that leaves all but a few stray points
 *  on its inner side. */
double
reach(const std::vector<Eigen::Vector3f>& points, int axis, int sign, double tangent)
{
  std::vector<double> offsets;
  for (const Eigen::Vector3f& point : points)
    offsets.push_back(sign * point[axis] - tangent * point.z());
  const auto place = std::ptrdiff_t(0.995 * double(offsets.size() - 1));
  std::nth_element(offsets.begin(), offsets.begin() + place, offsets.end());
  return offsets[place];
}

/** The mean view, moved until the mesh fills the picture. */
Pose
chooseView(const SurfaceMesh& mesh, const std::vector<Pose>& world_from_cameras)
{
  Pose world_from_view = meanView(world_from_cameras);
  const Eigen::Isometry3f view_from_world = world_from_view.inverse().cast<float>();
  std::vector<Eigen::Vector3f> seen;
  for (std::size_t i = 0; i < mesh.vertices.size(); i += mesh.vertices.size() / 100000 + 1)
    seen.emplace_back(view_from_world * mesh.vertices[i]);
  Eigen::Vector3d shift(0, 0, INFINITY);
  for (int axis = 0; axis < 2; ++axis) {
    // How far the planes through the picture's two opposite sides must be moved.
    const double tangent = 0.48 * PICTURE_SIZE[axis] / FOCAL_LENGTH;
    const double low = reach(seen, axis, -1, tangent), high = reach(seen, axis, 1, tangent);
    shift[axis] = (high - low) / 2;
    shift.z() = std::min(shift.z(), -(high + low) / (2 * tangent));
  }
  world_from_view.translation() += world_from_view.linear() * shift;
  return world_from_view;
}

std::vector<Corner>
project(const SurfaceMesh& mesh, const CameraIntrinsics& camera,
        const Eigen::Isometry3f& view_from_world)
{
  std::vector<Corner> corners(mesh.vertices.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3f point = view_from_world * mesh.vertices[i];
    if (!(point.z() > 0.05f))
      continue;
    corners[i].pixel = camera.project(point.cast<double>()).cast<float>();
    corners[i].inverse_depth = 1 / point.z();
    corners[i].color.setConstant(190);
    if (!mesh.colors.empty())
      for (int channel = 0; channel < 3; ++channel)
        corners[i].color[channel] = mesh.colors[i][2 - channel];
    if (mesh.normals.empty())
      continue;
    const float facing = -(view_from_world.linear() * mesh.normals[i]).dot(point.normalized());
    corners[i].color *= 0.7f + 0.3f * (facing < 1 ? std::max(facing, 0.0f) : 1.0f); // 1 for NaN
  }
  return corners;
}

/** Fills the pixels of a triangle that nothing nearer covers. */
void
drawTriangle(const Corner& a, const Corner& b, const Corner& c, cv::Mat& image,
             cv::Mat& inverse_depth)
{
  const Eigen::Vector2f ab = b.pixel - a.pixel, ac = c.pixel - a.pixel;
  const float area = ab.x() * ac.y() - ab.y() * ac.x();
  // Pixels run downwards: a face whose outside is seen runs clockwise on the paper.
  if (!(area < 0) || std::min({a.inverse_depth, b.inverse_depth, c.inverse_depth}) <= 0)
    return;
  const Eigen::Array2f low = a.pixel.cwiseMin(b.pixel).cwiseMin(c.pixel),
                       high = a.pixel.cwiseMax(b.pixel).cwiseMax(c.pixel),
                       size(float(image.cols), float(image.rows));
  const Eigen::Array2i first = low.max(0).min(size).ceil().cast<int>(),
                       last = high.max(-1).min(size - 1).floor().cast<int>();
  for (int v = first.y(); v <= last.y(); ++v)
    for (int u = first.x(); u <= last.x(); ++u) {
      const Eigen::Vector2f ap = Eigen::Vector2f(float(u), float(v)) - a.pixel;
      const float wb = (ap.x() * ac.y() - ap.y() * ac.x()) / area;
      const float wc = (ab.x() * ap.y() - ab.y() * ap.x()) / area;
      const float wa = 1 - wb - wc;
      const float nearness = wa * a.inverse_depth + wb * b.inverse_depth + wc * c.inverse_depth;
      float& nearest = inverse_depth.at<float>(v, u);
      if (std::min({wa, wb, wc}) < 0 || nearness <= nearest)
        continue;
      nearest = nearness;
      const Eigen::Vector3f color = wa * a.color + wb * b.color + wc * c.color;
      image.at<cv::Vec3b>(v, u) = cv::Vec3f(color.x(), color.y(), color.z());
    }
}

/** Points of a plane, with a grid of a round number of metres. */
void
drawPath(const std::vector<Eigen::Vector2d>& path, const std::string& title, cv::Mat panel)
{
  Eigen::Vector2d low = path.front(), high = low;
  for (const Eigen::Vector2d& point : path) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Eigen::Vector2d middle = (low + high) / 2;
  const double range = std::max(1.2 * (high - low).maxCoeff(), 0.01);
  constexpr int shift = 4; // fractional bits of a pixel
  const auto pixel = [&](const Eigen::Vector2d& point) {
    const Eigen::Vector2d offset = (point - middle) / range * panel.cols * (1 << shift);
    const int half = panel.cols << shift >> 1;
    return cv::Point(half + int(std::lround(offset.x())), half - int(std::lround(offset.y())));
  };
  const double power = std::pow(10.0, std::floor(std::log10(range / 6)));
  const double lines = range / power;
  const double step = power * (lines > 40 ? 10 : lines > 16 ? 5 : lines > 8 ? 2 : 1);
  for (int axis = 0; axis < 2; ++axis)
    for (double i = -std::ceil(range / step); i * step < range; ++i) {
      Eigen::Vector2d begin = middle.array() - range, end = middle.array() + range;
      begin[axis] = end[axis] = (std::floor(middle[axis] / step) + i) * step;
      cv::line(panel, pixel(begin), pixel(end), {225, 225, 225}, 1, cv::LINE_AA, shift);
    }
  for (std::size_t i = 0; i < path.size(); ++i) {
    cv::line(panel, pixel(path[i - (i > 0)]), pixel(path[i]), {180, 90, 20}, 1, cv::LINE_AA, shift);
    cv::circle(panel, pixel(path[i]), 2 << shift, {180, 90, 20}, cv::FILLED, cv::LINE_AA, shift);
  }
  cv::circle(panel, pixel(path.front()), 5 << shift, {60, 170, 60}, cv::FILLED, cv::LINE_AA, shift);
  cv::putText(panel, concatenate(title, ", grid of ", step, " m, green: first"), {12, 24},
              cv::FONT_HERSHEY_SIMPLEX, 0.5, {70, 70, 70}, 1, cv::LINE_AA);
  cv::rectangle(panel, {0, 0, panel.cols, panel.rows}, {70, 70, 70});
}

} // namespace

cv::Mat
drawMesh(const SurfaceMesh& mesh, const CameraIntrinsics& camera, const Pose& world_from_camera)
{
  const cv::Size size{camera.width, camera.height};
  cv::Mat image(size, CV_8UC3, cv::Scalar::all(255)), inverse_depth(size, CV_32FC1, cv::Scalar(0));
  const std::vector<Corner> corners =
      project(mesh, camera, world_from_camera.inverse().cast<float>());
  for (const auto& triangle : mesh.triangles)
    drawTriangle(corners[triangle[0]], corners[triangle[1]], corners[triangle[2]], image,
                 inverse_depth);
  return image;
}

cv::Mat
drawMesh(const SurfaceMesh& mesh, const std::vector<Pose>& world_from_cameras)
{
  const cv::Mat image = drawMesh(mesh, pictureCamera(), chooseView(mesh, world_from_cameras));
  cv::Mat picture;
  cv::resize(image, picture, image.size() / SUPERSAMPLING, 0, 0, cv::INTER_AREA);
  return picture;
}

cv::Mat
drawTrajectory(const std::vector<Pose>& world_from_cameras)
{
  const Eigen::Matrix3d axes = meanView(world_from_cameras).linear();
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const Pose& pose : world_from_cameras)
    up -= pose.linear().col(1);
  up -= up.dot(axes.col(0)) * axes.col(0);
  up = up.norm() > 1e-9 ? up.normalized() : Eigen::Vector3d(-axes.col(1));
  const Eigen::Vector3d right = axes.col(0), forward = up.cross(right);
  std::vector<Eigen::Vector2d> from_above, from_the_side;
  for (const Pose& pose : world_from_cameras) {
    const Eigen::Vector3d center = pose.translation();
    from_above.emplace_back(right.dot(center), forward.dot(center));
    from_the_side.emplace_back(forward.dot(center), up.dot(center));
  }
  cv::Mat picture(640, 1280, CV_8UC3, cv::Scalar::all(255));
  drawPath(from_above, "from above", picture.colRange(0, 640));
  drawPath(from_the_side, "from the side", picture.colRange(640, 1280));
  return picture;
}

} // namespace bundle_icp
