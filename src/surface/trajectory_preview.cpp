// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "surface/view_axes.h"

#include <bundle_icp/surface/preview.h>

#include <opencv2/imgproc.hpp>

#include <cmath>
#include <cstdio>

namespace bundle_icp {
namespace {

constexpr int scale = 2; // drawn at twice the size, then reduced
constexpr int panel_size = 640 * scale;
constexpr int margin = 64 * scale;

const cv::Scalar estimate_color(180, 90, 20), truth_color(60, 150, 235);
const cv::Scalar grid_color(225, 225, 225), text_color(70, 70, 70);

using Points = std::vector<Eigen::Vector2d>;

/** One plot: metres to pixels, with the same scale on both axes. */
struct Panel {
  cv::Mat image; ///< a part of the picture
  Eigen::Vector2d low;
  double pixels_per_metre;

  cv::Point
  pixel(const Eigen::Vector2d& point) const
  {
    const Eigen::Vector2d offset = (point - low) * pixels_per_metre;
    return {int(std::lround(margin + offset.x())),
            int(std::lround(panel_size - margin - offset.y()))};
  }
};

void
write(const Panel& panel, const std::string& text, cv::Point where,
      bool centered = false)
{
  const double size = 0.45 * scale;
  if (centered)
    where.x -=
        cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, size, scale, nullptr).width / 2;
  cv::putText(panel.image, text, where, cv::FONT_HERSHEY_SIMPLEX, size, text_color,
              scale, cv::LINE_AA);
}

// 1, 2 or 5 times a power of ten, about a sixth of the range.
double
gridStep(double range)
{
  const double power = std::pow(10.0, std::floor(std::log10(range / 6)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (range / (factor * power) <= 8)
      return factor * power;
  return 10 * power;
}

std::string
label(double value, double step)
{
  char text[32];
  const int digits =
      std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  std::snprintf(text, sizeof(text), "%.*f", digits, value == 0 ? 0.0 : value);
  return text;
}

void
drawGrid(const Panel& panel)
{
  const double range = (panel_size - 2 * margin) / panel.pixels_per_metre;
  const double step = gridStep(range);
  const auto line = [&panel](cv::Point a, cv::Point b) {
    cv::line(panel.image, a, b, grid_color, scale);
  };
  for (int axis = 0; axis < 2; ++axis)
    for (double i = std::ceil(panel.low[axis] / step);
         i * step <= panel.low[axis] + range; ++i) {
      Eigen::Vector2d begin = panel.low,
                      end = panel.low + Eigen::Vector2d::Constant(range);
      begin[axis] = end[axis] = i * step;
      line(panel.pixel(begin), panel.pixel(end));
      const cv::Point place = panel.pixel(begin);
      const std::string text = label(i * step, step);
      if (axis == 0)
        write(panel, text, {place.x, place.y + 18 * scale}, true);
      else
        write(panel, text, {place.x - 30 * scale, place.y + 5 * scale}, true);
    }
  cv::rectangle(panel.image, {margin, margin},
                {panel_size - margin, panel_size - margin}, text_color, scale);
}

void
drawPath(const Panel& panel, const Points& points, const cv::Scalar& color)
{
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::Point here = panel.pixel(points[i]);
    if (i > 0)
      cv::line(panel.image, panel.pixel(points[i - 1]), here, color, scale,
               cv::LINE_AA);
    cv::circle(panel.image, here, 2 * scale, color, cv::FILLED, cv::LINE_AA);
  }
}

void
drawPanel(const cv::Mat& image, const Points& path, const Points& truth,
          const std::string& title, const std::string& horizontal,
          const std::string& vertical)
{
  Eigen::Vector2d low = path.front(), high = low;
  for (const Points* points : {&path, &truth})
    for (const Eigen::Vector2d& point : *points) {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
  const double range = std::max(1.1 * (high - low).maxCoeff(), 0.01);
  const Eigen::Vector2d corner =
      (low + high) / 2 - Eigen::Vector2d::Constant(range / 2);
  const Panel panel{image, corner, (panel_size - 2 * margin) / range};
  drawGrid(panel);
  drawPath(panel, truth, truth_color);
  drawPath(panel, path, estimate_color);
  cv::circle(panel.image, panel.pixel(path.front()), 5 * scale, cv::Scalar(60, 170, 60),
             cv::FILLED, cv::LINE_AA);
  write(panel, title, {panel_size / 2, margin - 14 * scale}, true);
  write(panel, horizontal + " [m]", {panel_size / 2, panel_size - margin + 40 * scale},
        true);
  write(panel, vertical + " [m]", {8 * scale, margin - 14 * scale});
}

void
drawLegend(const cv::Mat& image, bool with_truth)
{
  const Panel whole{image, Eigen::Vector2d::Zero(), 1};
  const int y = 20 * scale;
  const auto entry = [&](int x, const cv::Scalar& color, const std::string& text) {
    cv::line(image, {x, y - 4 * scale}, {x + 24 * scale, y - 4 * scale}, color,
             3 * scale);
    write(whole, text, {x + 30 * scale, y});
  };
  entry(460 * scale, estimate_color, "estimated (green: first)");
  if (with_truth)
    entry(700 * scale, truth_color, "true");
}

Points
select(const std::vector<Pose>& poses, const Eigen::Vector3d& right,
       const Eigen::Vector3d& up)
{
  Points points;
  for (const Pose& pose : poses)
    points.emplace_back(right.dot(pose.translation()), up.dot(pose.translation()));
  return points;
}

} // namespace

cv::Mat
renderTrajectoryPreview(const std::vector<Pose>& world_from_cameras,
                        const std::vector<Pose>& truth)
{
  const Eigen::Matrix3d axes = meanView(world_from_cameras).linear();
  if (!truth.empty())
    meanView(truth); // the same demands
  const Eigen::Vector3d right = axes.col(0);
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const Pose& pose : world_from_cameras)
    up -= pose.linear().col(1);
  up -= up.dot(right) * right;
  up = up.norm() > 1e-9 ? Eigen::Vector3d(up.normalized())
                        : Eigen::Vector3d(-axes.col(1));
  const Eigen::Vector3d forward = up.cross(right);

  cv::Mat picture(panel_size, 2 * panel_size, CV_8UC3, cv::Scalar::all(255));
  const cv::Rect left_half(0, 0, panel_size, panel_size);
  drawPanel(picture(left_half), select(world_from_cameras, right, forward),
            select(truth, right, forward), "from above", "right", "forward");
  drawPanel(picture(left_half + cv::Point(panel_size, 0)),
            select(world_from_cameras, forward, up), select(truth, forward, up),
            "from the side", "forward", "up");
  drawLegend(picture, !truth.empty());
  cv::Mat reduced;
  cv::resize(picture, reduced, {}, 1.0 / scale, 1.0 / scale, cv::INTER_AREA);
  return reduced;
}

} // namespace bundle_icp
