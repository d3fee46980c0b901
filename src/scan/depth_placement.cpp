// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/depth_placement.h"

#include "common/parallel.h"
#include "refinement/format_text.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>

namespace bundle_icp {
namespace {

using Flip = DepthPlacement::Flip;

/** Zooms that are tried: of neighbours the better one still has most of the agreement. */
constexpr double ZOOMS[] = {0.75, 0.8, 0.85, 0.9, 0.95, 1, 1.05, 1.1, 1.17, 1.25, 1.33};

cv::Mat
warped(const cv::Mat& edges, Flip flip, double zoom)
{
  cv::Mat flipped, result;
  if (flip == Flip::NONE)
    flipped = edges;
  else
    cv::flip(edges, flipped, flip == Flip::SIDEWAYS ? 1 : flip == Flip::UPSIDE_DOWN ? 0 : -1);
  if (zoom == 1)
    return flipped;
  const cv::Matx23d about_centre(zoom, 0, 0.5 * (1 - zoom) * (edges.cols - 1), 0, zoom,
                                 0.5 * (1 - zoom) * (edges.rows - 1));
  cv::warpAffine(flipped, result, about_centre, edges.size());
  return normalised(result);
}

/** Room for shifts beside the images, in sizes that the transform is fast for. */
cv::Size
paddedSize(const cv::Size& size)
{
  return {cv::getOptimalDFTSize(size.width + size.width / 4),
          cv::getOptimalDFTSize(size.height + size.height / 4)};
}

cv::Mat
spectrum(const cv::Mat& image)
{
  cv::Mat padded(paddedSize(image.size()), CV_32FC1, cv::Scalar(0)), result;
  image.copyTo(padded({{0, 0}, image.size()}));
  cv::dft(padded, result, 0, image.rows);
  return result;
}

/** Sum over frames of the agreement at each shift; shifts to the left and up lie at the end. */
cv::Mat
sumOfAgreements(const std::vector<FrameLook>& looks, const std::vector<cv::Mat>& color_spectra,
                const DepthPlacement& placement)
{
  cv::Mat sum;
  for (std::size_t i = 0; i < looks.size(); ++i) {
    const cv::Mat depth = warped(looks[i].depth_edges, placement.flip, placement.zoom);
    if (depth.empty())
      continue;
    cv::Mat product;
    cv::mulSpectrums(color_spectra[i], spectrum(depth), product, 0, true);
    sum = sum.empty() ? product : cv::Mat(sum + product);
  }
  if (!sum.empty())
    cv::dft(sum, sum, cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
  return sum;
}

struct Peak {
  double sum = 0;
  cv::Point shift;
};

Peak
peakOf(const cv::Mat& sums, const cv::Size& size)
{
  Peak peak;
  for (int dy = -size.height / 4; dy <= size.height / 4; ++dy)
    for (int dx = -size.width / 4; dx <= size.width / 4; ++dx) {
      const float sum = sums.at<float>((dy + sums.rows) % sums.rows, (dx + sums.cols) % sums.cols);
      if (sum > peak.sum)
        peak = {sum, {dx, dy}};
    }
  return peak;
}

} // namespace

std::string
toString(const DepthPlacement& placement, double scale)
{
  std::string text = placement.flip == Flip::SIDEWAYS      ? "mirrored sideways"
                     : placement.flip == Flip::UPSIDE_DOWN ? "mirrored upside down"
                     : placement.flip == Flip::TURNED      ? "turned by 180 degrees"
                                                           : "";
  if (placement.zoom != 1)
    text += formatText("%szoomed by %.2f", text.empty() ? "" : ", ", placement.zoom);
  if (placement.shift != cv::Point())
    text += formatText("%smoved by %.0f px across and %.0f px down", text.empty() ? "" : ", ",
                       scale * placement.shift.x, scale * placement.shift.y);
  return text;
}

double
agreement(const FrameLook& look, const DepthPlacement& placement)
{
  FrameLook placed;
  placed.depth_edges = warped(look.depth_edges, placement.flip, placement.zoom);
  return agreement(placed, look, placement.shift);
}

DepthPlacement
bestPlacement(const std::vector<FrameLook>& looks, int num_threads)
{
  std::vector<cv::Mat> color_spectra(looks.size());
  parallelFor(looks.size(), num_threads, {},
              [&](std::size_t i) { color_spectra[i] = spectrum(looks[i].color_edges); });
  std::vector<DepthPlacement> placements;
  for (const double zoom : ZOOMS)
    placements.push_back({Flip::NONE, zoom, {}});
  for (const Flip flip : {Flip::SIDEWAYS, Flip::UPSIDE_DOWN, Flip::TURNED})
    placements.push_back({flip, 1, {}});
  std::vector<double> sums(placements.size(), 0);
  parallelFor(placements.size(), num_threads, {}, [&](std::size_t k) {
    const cv::Mat map = sumOfAgreements(looks, color_spectra, placements[k]);
    if (map.empty())
      return;
    const Peak peak = peakOf(map, looks.front().depth_edges.size());
    sums[k] = peak.sum;
    placements[k].shift = peak.shift;
  });
  return placements[std::size_t(std::max_element(sums.begin(), sums.end()) - sums.begin())];
}

} // namespace bundle_icp
