// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "curve_plot.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace bundle_icp {
namespace {

constexpr int SCALE = 2; // drawn at twice the size, then reduced
constexpr int PANEL_WIDTH = 640 * SCALE, PANEL_HEIGHT = 480 * SCALE;
constexpr int LEFT = 72 * SCALE, RIGHT = 24 * SCALE, TOP = 48 * SCALE,
              BOTTOM = 60 * SCALE;
constexpr int INSET = 40 * SCALE; ///< from the frame to the first and last step
constexpr int DODGE = 7 * SCALE; ///< between the series at one step: none hides another
constexpr int LEGEND_ROW = 22 * SCALE, LEGEND_COLUMNS = 4;
/** Fewer frames with a pose than this share make the marker hollow. */
constexpr double NEARLY_ALL = 0.9;

const cv::Scalar GRID(225, 225, 225), INK(70, 70, 70), WHITE = cv::Scalar::all(255);

/** Colours that the colour-blind can tell apart (Okabe and Ito), BGR. */
cv::Scalar
colorOf(std::size_t series)
{
  static const cv::Scalar colors[] = {{0, 159, 230},  {233, 180, 86}, {115, 158, 0},
                                      {0, 94, 213},   {178, 114, 0},  {167, 121, 204},
                                      {66, 228, 240}, {0, 0, 0}};
  return colors[series % std::size(colors)];
}

/** A vertical axis: values to the height within a panel. */
struct Scale {
  double low = 0, high = 1;
  bool is_logarithmic = false;
  std::vector<double> ticks;

  /** Share of the height, 0 at the bottom. */
  double
  height(double value) const
  {
    if (is_logarithmic)
      return std::log(value / low) / std::log(high / low);
    return (value - low) / (high - low);
  }
};

/** From 1, 2 or 5 times a power of ten below the values to the same above. */
Scale
errorScale(const std::vector<ConditionResult>& conditions)
{
  double least = 1e9, most = 0;
  for (const ConditionResult& result : conditions)
    for (const Measurement& m : result.measurements)
      if (m.absolute) {
        least = std::min(least, std::max(m.absolute->translation.rmse, 1e-5));
        most = std::max(most, std::max(m.absolute->translation.rmse, 1e-5));
      }
  if (most == 0)
    least = most = 0.01;
  Scale scale;
  scale.is_logarithmic = true;
  for (int power = -6; power <= 6; ++power)
    for (const double factor : {1, 2, 5})
      scale.ticks.push_back(factor * std::pow(10.0, power));
  const auto first =
      std::upper_bound(scale.ticks.begin(), scale.ticks.end(), least * 0.999) - 1;
  const auto last = std::upper_bound(first, scale.ticks.end(), most * 1.001);
  scale.ticks = {first, last + 1};
  scale.low = scale.ticks.front();
  scale.high = scale.ticks.back();
  return scale;
}

void
write(const cv::Mat& image, const std::string& text, cv::Point where, double align = 0,
      double size = 0.45)
{
  const cv::Size extent =
      cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, size * SCALE, SCALE, nullptr);
  where.x -= int(align * extent.width);
  cv::putText(image, text, where, cv::FONT_HERSHEY_SIMPLEX, size * SCALE, INK, SCALE,
              cv::LINE_AA);
}

void
drawMarker(const cv::Mat& image, cv::Point where, const cv::Scalar& color,
           bool is_filled)
{
  cv::circle(image, where, 5 * SCALE, is_filled ? color : WHITE, cv::FILLED,
             cv::LINE_AA);
  cv::circle(image, where, 5 * SCALE, color, 2 * SCALE, cv::LINE_AA);
}

/** One of the two plots. */
class Panel {
public:
  Panel(const cv::Mat& image, const Scale& scale, std::size_t steps)
      : image_(image), scale_(scale), steps_(steps)
  {
  }

  void
  drawAxes(const std::string& title, const std::vector<std::string>& labels,
           const std::string& horizontal, const char* tick_format) const
  {
    for (const double tick : scale_.ticks) {
      const int y = at(0, tick).y;
      cv::line(image_, {LEFT, y}, {PANEL_WIDTH - RIGHT, y}, GRID, SCALE);
      char text[32];
      std::snprintf(text, sizeof(text), tick_format, tick);
      write(image_, text, {LEFT - 8 * SCALE, y + 5 * SCALE}, 1);
    }
    for (std::size_t i = 0; i < steps_; ++i) {
      const int x = at(i, scale_.low).x;
      cv::line(image_, {x, TOP}, {x, PANEL_HEIGHT - BOTTOM}, GRID, SCALE);
      write(image_, labels[i], {x, PANEL_HEIGHT - BOTTOM + 20 * SCALE}, 0.5);
    }
    cv::rectangle(image_, {LEFT, TOP}, {PANEL_WIDTH - RIGHT, PANEL_HEIGHT - BOTTOM},
                  INK, SCALE);
    write(image_, title, {(LEFT + PANEL_WIDTH - RIGHT) / 2, TOP - 14 * SCALE}, 0.5,
          0.5);
    write(image_, horizontal,
          {(LEFT + PANEL_WIDTH - RIGHT) / 2, PANEL_HEIGHT - BOTTOM + 44 * SCALE}, 0.5);
  }

  cv::Point
  at(std::size_t step, double value) const
  {
    const double left = LEFT + INSET, right = PANEL_WIDTH - RIGHT - INSET;
    const double across = double(step) / double(std::max<std::size_t>(1, steps_ - 1));
    return {int(std::lround(left + across * (right - left))),
            int(std::lround(PANEL_HEIGHT - BOTTOM -
                            scale_.height(value) * (PANEL_HEIGHT - BOTTOM - TOP)))};
  }

  /** `value` gives nothing where a series has a gap. */
  template <typename Value>
  void
  drawSeries(const std::vector<ConditionResult>& conditions, std::size_t series,
             const Value& value) const
  {
    const double middle = 0.5 * double(conditions.front().measurements.size() - 1);
    const cv::Point aside(int(DODGE * (double(series) - middle)), 0);
    std::vector<std::optional<cv::Point>> points;
    for (const ConditionResult& result : conditions) {
      const std::optional<double> y = value(result.measurements[series]);
      points.push_back(y ? std::optional<cv::Point>(at(points.size(), *y) + aside)
                         : std::nullopt);
    }
    for (std::size_t i = 1; i < steps_; ++i)
      if (points[i - 1] && points[i])
        cv::line(image_, *points[i - 1], *points[i], colorOf(series), 2 * SCALE,
                 cv::LINE_AA);
    for (std::size_t i = 0; i < steps_; ++i)
      if (points[i])
        drawMarker(image_, *points[i], colorOf(series),
                   conditions[i].measurements[series].share() >= NEARLY_ALL);
  }

private:
  const cv::Mat image_; ///< a part of the picture
  const Scale scale_;
  const std::size_t steps_;
};

std::optional<double>
errorOf(const Measurement& m)
{
  if (!m.absolute)
    return std::nullopt;
  return std::max(m.absolute->translation.rmse, 1e-5);
}

std::optional<double>
shareOf(const Measurement& m)
{
  return 100 * m.share();
}

void
drawLegend(const cv::Mat& image, const std::vector<Measurement>& series)
{
  for (std::size_t s = 0; s < series.size(); ++s) {
    const int x =
        LEFT + int(s % LEGEND_COLUMNS) * (2 * PANEL_WIDTH - LEFT) / LEGEND_COLUMNS;
    const int y = LEGEND_ROW * (1 + int(s / LEGEND_COLUMNS));
    cv::line(image, {x, y}, {x + 32 * SCALE, y}, colorOf(s), 2 * SCALE, cv::LINE_AA);
    drawMarker(image, {x + 16 * SCALE, y}, colorOf(s), true);
    write(image, series[s].variant, {x + 42 * SCALE, y + 5 * SCALE});
  }
}

} // namespace

cv::Mat
plotCurve(const std::string& scan, const std::vector<ConditionResult>& conditions,
          Axis axis)
{
  const std::vector<Measurement>& series = conditions.front().measurements;
  const int rows = int((series.size() + LEGEND_COLUMNS - 1) / LEGEND_COLUMNS);
  const int top = 40 * SCALE, legend_height = LEGEND_ROW * (rows + 2);
  cv::Mat picture(top + PANEL_HEIGHT + legend_height, 2 * PANEL_WIDTH, CV_8UC3, WHITE);
  write(picture, scan, {PANEL_WIDTH, 28 * SCALE}, 0.5, 0.6);
  std::vector<std::string> labels;
  for (const ConditionResult& result : conditions)
    labels.push_back(label(result.condition, axis));
  const cv::Rect left(0, top, PANEL_WIDTH, PANEL_HEIGHT);
  const Panel errors(picture(left), errorScale(conditions), conditions.size());
  const Panel shares(picture(left + cv::Point(PANEL_WIDTH, 0)),
                     {0, 105, false, {0, 20, 40, 60, 80, 100}}, conditions.size());
  errors.drawAxes("ATE RMSE [m]", labels, title(axis), "%g");
  shares.drawAxes("frames with a pose [%]", labels, title(axis), "%.0f");
  for (std::size_t s = 0; s < series.size(); ++s) {
    errors.drawSeries(conditions, s, errorOf);
    shares.drawSeries(conditions, s, shareOf);
  }
  const cv::Mat legend =
      picture(cv::Rect(0, top + PANEL_HEIGHT, picture.cols, legend_height));
  drawLegend(legend, series);
  write(legend, "hollow: fewer than 90 % of the frames have a pose",
        {LEFT, LEGEND_ROW * (rows + 1) + 5 * SCALE});
  cv::Mat reduced;
  cv::resize(picture, reduced, {}, 1.0 / SCALE, 1.0 / SCALE, cv::INTER_AREA);
  return reduced;
}

} // namespace bundle_icp
