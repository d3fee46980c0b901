// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/texture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

namespace bundle_icp {
namespace simulation {
namespace {

/** Noise of zero mean and standard deviation about one: octaves from `coarsest` texels
 * down to two, each with an amplitude that falls with `decay`. CV_32FC1. */
cv::Mat
fractalNoise(const cv::Size& size, cv::RNG& random, cv::Size2f coarsest, double decay)
{
  cv::Mat sum = cv::Mat::zeros(size, CV_32FC1), octave;
  double amplitude = 1, power = 0;
  while (std::max(coarsest.width, coarsest.height) >= 2) {
    const cv::Size grid(int(size.width / std::max(coarsest.width, 1.f)) + 4,
                        int(size.height / std::max(coarsest.height, 1.f)) + 4);
    cv::Mat nodes(grid, CV_32FC1);
    random.fill(nodes, cv::RNG::UNIFORM, -2.f, 2.f);
    cv::resize(nodes, octave, size, 0, 0, cv::INTER_LINEAR);
    cv::scaleAdd(octave, amplitude, sum, sum);
    power += amplitude * amplitude;
    amplitude *= decay;
    coarsest.width /= 2;
    coarsest.height /= 2;
  }
  return sum / std::sqrt(std::max(power, 1e-12) * 0.6);
}

/** Adds grey noise of standard deviation `amplitude` grey levels. */
void
addNoise(cv::Mat canvas, const cv::Mat& noise, double amplitude)
{
  cv::Mat gray, color;
  noise.convertTo(gray, CV_16SC1, amplitude);
  cv::merge(std::vector<cv::Mat>(3, gray), color);
  cv::add(canvas, color, canvas, cv::noArray(), CV_8UC3);
}

cv::Scalar
randomColor(cv::RNG& random, int low = 25, int high = 235)
{
  return {double(random.uniform(low, high)), double(random.uniform(low, high)),
          double(random.uniform(low, high))};
}

/** A colour near `base`, so that a picture keeps a palette. */
cv::Scalar
vary(const cv::Scalar& base, cv::RNG& random, double spread)
{
  const double light = random.gaussian(spread);
  cv::Scalar color;
  for (int c = 0; c < 3; ++c)
    color[c] = std::clamp(base[c] + light + random.gaussian(0.4 * spread), 8.0, 250.0);
  return color;
}

std::string
randomWords(cv::RNG& random, int letters)
{
  static const char* const syllables[] = {
      "ba", "cor", "di", "fel", "gu", "ha", "KIN", "lo",  "mi", "Nor", "pe", "qua",
      "ri", "St",  "tu", "vel", "wo", "xi", "You", "zan", "7",  "42",  "&"};
  std::string text;
  while (int(text.size()) < letters) {
    text += syllables[random.uniform(0, int(std::size(syllables)))];
    if (random.uniform(0, 3) == 0)
      text += ' ';
  }
  return text;
}

void
drawText(cv::Mat canvas, cv::RNG& random, cv::Point origin, double height,
         const cv::Scalar& color)
{
  const double scale = height / 22; // the font's capitals are 22 px high
  const int letters =
      std::max(3, int(0.9 * (canvas.cols - 2 * origin.x) / (0.75 * height)));
  cv::putText(canvas, randomWords(random, letters), origin,
              random.uniform(0, 2) ? cv::FONT_HERSHEY_DUPLEX : cv::FONT_HERSHEY_TRIPLEX,
              scale, color, std::max(1, int(height / 9)), cv::LINE_AA);
}

void
drawBlot(cv::Mat canvas, cv::RNG& random, cv::Point center, double radius,
         const cv::Scalar& color)
{
  if (random.uniform(0, 2)) {
    cv::ellipse(canvas, center,
                cv::Size(int(radius), int(radius * random.uniform(0.3, 1.0))),
                random.uniform(0.0, 180.0), 0, 360, color, cv::FILLED, cv::LINE_AA);
    return;
  }
  std::vector<cv::Point> corners;
  const double start = random.uniform(0.0, 6.28);
  const int count = random.uniform(3, 6);
  for (int i = 0; i < count; ++i) {
    const double angle = start + 6.2832 * i / count,
                 r = radius * random.uniform(0.6, 1.2);
    corners.emplace_back(int(center.x + r * std::cos(angle)),
                         int(center.y + r * std::sin(angle)));
  }
  cv::fillConvexPoly(canvas, corners, color, cv::LINE_AA);
}

} // namespace

void
paintPicture(cv::Mat canvas, cv::RNG& random)
{
  cv::Scalar palette[4];
  for (auto& color : palette)
    color = randomColor(random);
  canvas.setTo(palette[0]);
  const double largest = 0.3 * std::min(canvas.cols, canvas.rows), smallest = 2.5;
  // Numbers that fall with the cube of the size make every scale cover the same area.
  const int count = std::clamp(int(double(canvas.total()) / 110), 30, 6000);
  for (int i = 0; i < count; ++i) {
    const double part = double(i) / count;
    const double radius =
        std::max(smallest, largest * std::pow(1 - part, 4) * random.uniform(0.4, 1.));
    const cv::Point center(random.uniform(0, canvas.cols),
                           random.uniform(0, canvas.rows));
    drawBlot(canvas, random, center, radius,
             vary(palette[random.uniform(0, 4)], random, 28));
  }
  addNoise(canvas, fractalNoise(canvas.size(), random, {32, 32}, 0.8), 6);
  cv::GaussianBlur(canvas, canvas, {}, 0.6);
}

void
paintPoster(cv::Mat canvas, cv::RNG& random)
{
  canvas.setTo(random.uniform(0, 2) ? cv::Scalar(40, 45, 50)
                                    : cv::Scalar(225, 228, 230));
  const int frame = std::max(2, std::min(canvas.cols, canvas.rows) / 18);
  const cv::Rect inside(frame, frame, canvas.cols - 2 * frame, canvas.rows - 2 * frame);
  if (inside.width < 8 || inside.height < 8)
    return;
  cv::Mat picture = canvas(inside);
  paintPicture(picture, random);
  const double height = std::clamp(picture.cols / 14.0, 6.0, 40.0);
  const int band = int(2.2 * height);
  if (picture.rows < 3 * band)
    return;
  picture.rowRange(picture.rows - band, picture.rows)
      .setTo(randomColor(random, 190, 250));
  drawText(picture, random, {int(height), picture.rows - int(0.6 * height)}, height,
           randomColor(random, 10, 70));
}

void
paintPackage(cv::Mat canvas, cv::RNG& random)
{
  const cv::Scalar base = randomColor(random, 30, 220);
  const bool dark = base[0] + base[1] + base[2] < 380;
  const cv::Scalar ink =
      dark ? randomColor(random, 190, 250) : randomColor(random, 5, 60);
  canvas.setTo(base);
  const double height = std::clamp(canvas.rows / 11.0, 5.0, 30.0);
  for (double y = 1.5 * height; y < canvas.rows - 0.5 * height; y += 1.7 * height) {
    const int kind = random.uniform(0, 5);
    if (kind <= 2)
      drawText(canvas, random, {int(0.4 * height), int(y)},
               height * random.uniform(0.5, 1.0), ink);
    else if (kind == 3)
      cv::rectangle(canvas, {0, int(y - height)}, {canvas.cols, int(y)},
                    vary(base, random, 60), cv::FILLED);
    else
      for (int i = 0; i < 6; ++i)
        drawBlot(canvas, random,
                 {random.uniform(0, canvas.cols), int(y - 0.5 * height)},
                 height * random.uniform(0.3, 0.8), randomColor(random));
  }
  addNoise(canvas, fractalNoise(canvas.size(), random, {64, 64}, 0.8), 5);
  cv::GaussianBlur(canvas, canvas, {}, 0.6);
}

void
paintWood(cv::Mat canvas, cv::RNG& random, const cv::Scalar& color, int board_width)
{
  const bool upright = canvas.rows > canvas.cols;
  const int across = upright ? canvas.cols : canvas.rows,
            along = upright ? canvas.rows : canvas.cols;
  cv::Mat boards(across, along, CV_8UC3);
  for (int y = 0; y < across; y += board_width) {
    cv::Mat row = boards.rowRange(y, std::min(y + board_width, across));
    int x = -random.uniform(0, 5 * board_width);
    while (x < along) {
      const int end = x + board_width * random.uniform(4, 9);
      row.colRange(std::clamp(x, 0, along), std::clamp(end, 0, along))
          .setTo(vary(color, random, 11));
      cv::line(row, {end, 0}, {end, row.rows}, color * 0.45, 2, cv::LINE_AA);
      x = end;
    }
    cv::line(boards, {0, y}, {along, y}, color * 0.45, 1, cv::LINE_AA);
  }
  addNoise(boards, fractalNoise(boards.size(), random, {96, 6}, 0.8), 11);
  addNoise(boards, fractalNoise(boards.size(), random, {16, 16}, 1.0), 6);
  for (int i = 0; i < int(boards.total() / 4000); ++i) // knots and dents
    drawBlot(boards, random, {random.uniform(0, along), random.uniform(0, across)},
             random.uniform(1.5, 5.5),
             vary(color * random.uniform(0.35, 1.3), random, 10));
  cv::GaussianBlur(boards, boards, {}, 0.7);
  if (upright)
    cv::rotate(boards, boards, cv::ROTATE_90_CLOCKWISE);
  boards.copyTo(canvas);
}

void
paintPlaster(cv::Mat canvas, cv::RNG& random, const cv::Scalar& color, float contrast)
{
  canvas.setTo(color);
  addNoise(canvas, fractalNoise(canvas.size(), random, {160, 160}, 0.75), 6 * contrast);
  for (int i = 0; i < int(contrast * float(canvas.total()) / 2500); ++i)
    drawBlot(canvas, random,
             {random.uniform(0, canvas.cols), random.uniform(0, canvas.rows)},
             std::exp(random.uniform(0.5, 2.2)),
             vary(color * random.uniform(0.75, 1.08), random, 8));
  cv::GaussianBlur(canvas, canvas, {}, 0.8);
}

void
paintRug(cv::Mat canvas, cv::RNG& random)
{
  const cv::Scalar base(50, 45, 125), light(120, 165, 195), blue(110, 60, 40);
  canvas.setTo(base);
  const int step = std::max(8, std::min(canvas.cols, canvas.rows) / 12);
  for (int y = 0; y < canvas.rows; y += step)
    for (int x = 0; x < canvas.cols; x += step) {
      const cv::Point center(x + step / 2, y + step / 2);
      const cv::Scalar color =
          vary((x / step + y / step) % 2 ? light : blue, random, 14);
      const int r = step * random.uniform(30, 46) / 100;
      cv::fillConvexPoly(canvas,
                         std::vector<cv::Point>{{center.x - r, center.y},
                                                {center.x, center.y - r},
                                                {center.x + r, center.y},
                                                {center.x, center.y + r}},
                         color, cv::LINE_AA);
      drawBlot(canvas, random, center, r * random.uniform(0.25, 0.6),
               vary(base, random, 30));
    }
  cv::rectangle(canvas, {step / 4, step / 4},
                {canvas.cols - step / 4, canvas.rows - step / 4}, light,
                std::max(2, step / 8), cv::LINE_AA);
  addNoise(canvas, fractalNoise(canvas.size(), random, {12, 12}, 1.0), 11);
  cv::GaussianBlur(canvas, canvas, {}, 0.7);
}

} // namespace simulation
} // namespace bundle_icp
