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

/** Noise of zero mean and standard deviation about one, CV_32FC1: octaves from
 * `coarsest` texels down to two, each with an amplitude that falls with `decay`. */
cv::Mat
fractalNoise(const cv::Size& size, cv::RNG& random, cv::Size2f coarsest, double decay)
{
  cv::Mat sum, nodes;
  double amplitude = 1, power = 0;
  while (std::max(coarsest.width, coarsest.height) >= 2) {
    // Each octave is added at its own resolution, and all are enlarged together.
    nodes.create(int(float(size.height) / std::max(coarsest.height, 1.f)) + 2,
                 int(float(size.width) / std::max(coarsest.width, 1.f)) + 2, CV_32FC1);
    random.fill(nodes, cv::RNG::UNIFORM, -2 * amplitude, 2 * amplitude);
    if (!sum.empty()) {
      cv::resize(sum, sum, nodes.size(), 0, 0, cv::INTER_LINEAR);
      nodes += sum;
    }
    cv::swap(sum, nodes);
    power += amplitude * amplitude;
    amplitude *= decay;
    coarsest = {coarsest.width / 2, coarsest.height / 2};
  }
  cv::resize(sum, sum, size, 0, 0, cv::INTER_LINEAR);
  return sum / std::sqrt(0.6 * power);
}

/** Adds grey noise of standard deviation `amplitude` grey levels. */
void
addNoise(cv::Mat canvas, const cv::Mat& noise, float amplitude)
{
  for (int y = 0; y < canvas.rows; ++y) {
    auto* pixel = canvas.ptr<cv::Vec3b>(y);
    const auto* added = noise.ptr<float>(y);
    for (int x = 0; x < canvas.cols; ++x) {
      const int level = int(amplitude * added[x]);
      for (int c = 0; c < 3; ++c)
        pixel[x][c] = uchar(std::clamp(pixel[x][c] + level, 0, 255));
    }
  }
}

/** BGR of a hue, saturation and brightness, the first two 0 to 1, the last of 255. */
cv::Scalar
fromHue(double hue, double saturation, double brightness)
{
  cv::Scalar color;
  for (int c = 0; c < 3; ++c) {
    const double k = std::fmod(1 + 2 * c + 6 * (hue - std::floor(hue)), 6);
    color[c] = brightness * (1 - saturation * std::clamp(std::min(k, 4 - k), 0.0, 1.0));
  }
  return color;
}

// Below, random numbers are drawn one a statement: the order of arguments is the
// compiler's.

/** A muted colour of a hue. */
cv::Scalar
shadeOf(double hue, cv::RNG& random, double darkest, double brightest)
{
  const double saturation = random.uniform(0.1, 0.65);
  return fromHue(hue, saturation, random.uniform(darkest, brightest));
}

/** A muted colour of any hue. */
cv::Scalar
randomColor(cv::RNG& random, double darkest = 40, double brightest = 230)
{
  const double hue = random.uniform(0.0, 1.0);
  return shadeOf(hue, random, darkest, brightest);
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
  static const char* const syllables[] = {"ba", "cor", "di",  "fel", "gu", "ha", "KIN", "lo",
                                          "mi", "Nor", "pe",  "qua", "ri", "St", "tu",  "vel",
                                          "wo", "xi",  "You", "zan", "7",  "42", "&"};
  std::string text;
  while (int(text.size()) < letters) {
    text += syllables[random.uniform(0, int(std::size(syllables)))];
    if (random.uniform(0, 3) == 0)
      text += ' ';
  }
  return text;
}

void
drawText(cv::Mat canvas, cv::RNG& random, cv::Point origin, double height, const cv::Scalar& color)
{
  const double scale = height / 22; // the font's capitals are 22 px high
  const int letters = std::max(3, int(0.9 * (canvas.cols - 2 * origin.x) / (0.75 * height)));
  const std::string words = randomWords(random, letters);
  const int font = random.uniform(0, 2) ? cv::FONT_HERSHEY_DUPLEX : cv::FONT_HERSHEY_TRIPLEX;
  cv::putText(canvas, words, origin, font, scale, color, std::max(1, int(height / 9)), cv::LINE_AA);
}

void
drawBlot(cv::Mat canvas, cv::RNG& random, cv::Point center, double radius, const cv::Scalar& color)
{
  if (random.uniform(0, 2)) {
    const cv::Size axes(int(radius), int(radius * random.uniform(0.3, 1.0)));
    const double angle = random.uniform(0.0, 180.0);
    cv::ellipse(canvas, center, axes, angle, 0, 360, color, cv::FILLED, cv::LINE_AA);
    return;
  }
  std::vector<cv::Point> corners;
  const double start = random.uniform(0.0, 6.28);
  const int count = random.uniform(3, 6);
  for (int i = 0; i < count; ++i) {
    const double angle = start + 6.2832 * i / count, r = radius * random.uniform(0.6, 1.2);
    corners.emplace_back(int(center.x + r * std::cos(angle)), int(center.y + r * std::sin(angle)));
  }
  cv::fillConvexPoly(canvas, corners, color, cv::LINE_AA);
}

/** Blots of radius exp(0.3) to exp(`largest`) anywhere, in darker and lighter kinds of
 * a colour. */
void
scatterBlots(cv::Mat canvas, cv::RNG& random, int count, double largest, const cv::Scalar& color)
{
  for (int i = 0; i < count; ++i) {
    const int x = random.uniform(0, canvas.cols);
    const int y = random.uniform(0, canvas.rows);
    const double radius = std::exp(random.uniform(0.3, largest));
    // The larger, the fainter.
    const double contrast = 0.5 / (1 + 0.25 * radius);
    const double brightness = 1 + contrast * random.uniform(-1.0, 0.35);
    drawBlot(canvas, random, {x, y}, radius, vary(color * brightness, random, 4));
  }
}

} // namespace

void
paintPicture(cv::Mat canvas, cv::RNG& random)
{
  const double hue = random.uniform(0.0, 1.0);
  const double other_hue = hue + random.uniform(0.08, 0.5);
  const cv::Scalar palette[] = {shadeOf(hue, random, 110, 190), shadeOf(hue, random, 40, 90),
                                shadeOf(other_hue, random, 140, 220),
                                shadeOf(other_hue, random, 190, 240)};
  canvas.setTo(palette[0]);
  const double largest = 0.3 * std::min(canvas.cols, canvas.rows), smallest = 2.5;
  // Many small blots over few large ones: something to see at every scale.
  const int count = std::clamp(int(double(canvas.total()) / 110), 30, 6000);
  for (int i = 0; i < count; ++i) {
    const double part = double(i) / count;
    const double radius =
        std::max(smallest, largest * std::pow(1 - part, 4) * random.uniform(0.4, 1.));
    const cv::Point center(random.uniform(0, canvas.cols), random.uniform(0, canvas.rows));
    const cv::Scalar color = vary(palette[random.uniform(0, 4)], random, 24);
    drawBlot(canvas, random, center, radius, color);
  }
  addNoise(canvas, fractalNoise(canvas.size(), random, {32, 32}, 0.8), 6);
  cv::GaussianBlur(canvas, canvas, {}, 0.6);
}

void
paintPoster(cv::Mat canvas, cv::RNG& random)
{
  const cv::Scalar dark(40, 45, 50), bright(225, 228, 230);
  canvas.setTo(random.uniform(0, 2) ? dark : bright);
  const int frame = std::max(2, std::min(canvas.cols, canvas.rows) / 18);
  const cv::Rect inside(frame, frame, canvas.cols - 2 * frame, canvas.rows - 2 * frame);
  if (std::min(inside.width, inside.height) < 40) { // the edge of a frame
    canvas.setTo(dark);
    return;
  }
  cv::Mat picture = canvas(inside);
  paintPicture(picture, random);
  const double height = std::clamp(picture.cols / 14.0, 6.0, 40.0);
  const int band = int(2.2 * height);
  if (picture.rows < 3 * band)
    return;
  picture.rowRange(picture.rows - band, picture.rows).setTo(randomColor(random, 190, 250));
  drawText(picture, random, {int(height), picture.rows - int(0.6 * height)}, height,
           randomColor(random, 10, 70));
}

void
paintPackage(cv::Mat canvas, cv::RNG& random)
{
  const cv::Scalar base = randomColor(random, 30, 220);
  const bool dark = base[0] + base[1] + base[2] < 380;
  const cv::Scalar ink = dark ? randomColor(random, 190, 250) : randomColor(random, 5, 60);
  canvas.setTo(base);
  const double height = std::clamp(canvas.rows / 11.0, 5.0, 30.0);
  for (double y = 1.5 * height; y < canvas.rows - 0.5 * height; y += 1.7 * height) {
    const int kind = random.uniform(0, 5);
    if (kind <= 2)
      drawText(canvas, random, {int(0.4 * height), int(y)}, height * random.uniform(0.5, 1.0), ink);
    else if (kind == 3)
      cv::rectangle(canvas, {0, int(y - height)}, {canvas.cols, int(y)}, vary(base, random, 60),
                    cv::FILLED);
    else
      for (int i = 0; i < 6; ++i) {
        const cv::Point center(random.uniform(0, canvas.cols), int(y - 0.5 * height));
        const double radius = height * random.uniform(0.3, 0.8);
        drawBlot(canvas, random, center, radius, randomColor(random));
      }
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
  scatterBlots(boards, random, int(boards.total() / 1500), 1.7,
               color); // knots and dents
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
  scatterBlots(canvas, random, int(contrast * float(canvas.total()) / 500), 2.0, color);
  cv::GaussianBlur(canvas, canvas, {}, 0.8);
}

void
paintRug(cv::Mat canvas, cv::RNG& random)
{
  const cv::Scalar base(58, 52, 118), light(130, 165, 188), blue(105, 68, 52);
  canvas.setTo(base);
  const int step = std::max(8, std::min(canvas.cols, canvas.rows) / 12);
  for (int y = 0; y < canvas.rows; y += step)
    for (int x = 0; x < canvas.cols; x += step) {
      const cv::Point center(x + step / 2, y + step / 2);
      const cv::Scalar color = vary((x / step + y / step) % 2 ? light : blue, random, 14);
      const int r = step * random.uniform(30, 46) / 100;
      cv::fillConvexPoly(canvas,
                         std::vector<cv::Point>{{center.x - r, center.y},
                                                {center.x, center.y - r},
                                                {center.x + r, center.y},
                                                {center.x, center.y + r}},
                         color, cv::LINE_AA);
      const double radius = r * random.uniform(0.25, 0.6);
      drawBlot(canvas, random, center, radius, vary(base, random, 30));
    }
  cv::rectangle(canvas, {step / 4, step / 4}, {canvas.cols - step / 4, canvas.rows - step / 4},
                light, std::max(2, step / 8), cv::LINE_AA);
  addNoise(canvas, fractalNoise(canvas.size(), random, {12, 12}, 1.0), 11);
  cv::GaussianBlur(canvas, canvas, {}, 0.7);
}

} // namespace simulation
} // namespace bundle_icp
