// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/check_together.h"

#include <cmath>
#include <opencv2/core.hpp>

namespace bundle_icp {
namespace {

/** Fewest frames with edges in depth and colour that say something. */
constexpr std::size_t FEWEST_FRAMES = 6;
/** So many standard deviations of a mean are no chance, though many shifts are tried. */
constexpr double SURE = 5;
/** Largest shift between depth and colour that is tried [px of the images of edges]. */
constexpr int FARTHEST_SHIFT = 10;

/** Smallest shift that no tolerance of a camera's own registration explains, in the same unit. */
constexpr double NEAREST_SHIFT = 4;

/** A mean and how many of its standard deviations it lies above 0. */
struct Mean {
  std::size_t count = 0;
  double mean = 0, deviations = 0;
};

Mean
meanOf(const std::vector<double>& values)
{
  Mean result{values.size(), 0, 0};
  double sum = 0, squares = 0;
  for (const double value : values) {
    sum += value;
    squares += value * value;
  }
  if (values.size() < FEWEST_FRAMES)
    return result;
  const double number = double(values.size());
  result.mean = sum / number;
  const double variance = std::max(0.0, squares / number - result.mean * result.mean);
  result.deviations = result.mean / (std::sqrt(variance / number) + 1e-6);
  return result;
}

/** How much better the depth edges of each frame lie on the colour edges of the frame `shift`
 *  later in its run than on its own. */
Mean
gainOfShift(const Sample& sample, std::ptrdiff_t shift)
{
  std::vector<double> gains;
  for (std::size_t i = 0; i < sample.looks.size(); ++i) {
    const std::ptrdiff_t j = std::ptrdiff_t(i) + shift;
    if (j < 0 || j >= std::ptrdiff_t(sample.looks.size()) ||
        std::ptrdiff_t(sample.places[std::size_t(j)]) - std::ptrdiff_t(sample.places[i]) !=
            shift * std::ptrdiff_t(sample.step))
      continue;
    const FrameLook &look = sample.looks[i], &other = sample.looks[std::size_t(j)];
    if (!look.depth_edges.empty() && !look.color_edges.empty() && !other.color_edges.empty())
      gains.push_back(agreement(look, other) - agreement(look, look));
  }
  return meanOf(gains);
}

/** Looks for a shift of the image that brings depth edges onto colour edges. */
void
checkRegistration(const Sample& sample, std::vector<Finding>& findings)
{
  cv::Point best;
  Mean best_gain;
  for (int dy = -FARTHEST_SHIFT; dy <= FARTHEST_SHIFT; dy += 2)
    for (int dx = -FARTHEST_SHIFT; dx <= FARTHEST_SHIFT; dx += 2) {
      std::vector<double> gains;
      for (const FrameLook& look : sample.looks)
        if (!look.depth_edges.empty() && !look.color_edges.empty())
          gains.push_back(agreement(look, look, {dx, dy}) - agreement(look, look));
      if (const Mean gain = meanOf(gains); gain.mean > best_gain.mean) {
        best_gain = gain;
        best = {dx, dy};
      }
    }
  if (best_gain.count < 2 * FEWEST_FRAMES || best_gain.deviations < SURE || best_gain.mean < 0.1 ||
      cv::norm(best) < NEAREST_SHIFT)
    return;
  const double pixels = cv::norm(best) * sample.pixels_per_edge_pixel;
  findings.push_back({Severity::WARNING,
                      "color_and_depth",
                      "edges in depth lie about " + std::to_string(int(std::lround(pixels))) +
                          " px beside those in colour: depth is not registered to colour",
                      {{"shift_px", pixels}, {"deviations", best_gain.deviations}},
                      "record depth aligned to the colour camera"});
}

} // namespace

void
checkTogether(const Sample& sample, std::vector<Finding>& findings)
{
  std::ptrdiff_t best = 0;
  Mean best_gain;
  const auto most = std::ptrdiff_t(sample.looks.size()) - 1;
  for (std::ptrdiff_t shift = -most; shift <= most; ++shift)
    if (const Mean gain = gainOfShift(sample, shift);
        shift != 0 && gain.deviations > best_gain.deviations) {
      best_gain = gain;
      best = shift;
    }
  if (best_gain.deviations > SURE && best_gain.mean > 0.02) {
    const std::size_t frames = std::size_t(std::abs(best)) * sample.step;
    findings.push_back({Severity::FAULT,
                        "color_and_depth",
                        "colour and depth are of other moments: edges in depth lie on those of "
                        "the colour image " +
                            std::to_string(frames) + (best > 0 ? " later" : " earlier") +
                            ", not on those of their own",
                        {{"frames_apart", double(frames)}, {"deviations", best_gain.deviations}},
                        "pair the images by time"});
    return;
  }
  std::vector<double> own;
  for (const FrameLook& look : sample.looks)
    if (!look.depth_edges.empty() && !look.color_edges.empty())
      own.push_back(agreement(look, look));
  const Mean together = meanOf(own);
  if (together.count >= 2 * FEWEST_FRAMES && together.mean < 0.02 && together.deviations < 2)
    findings.push_back({Severity::FAULT,
                        "color_and_depth",
                        "colour and depth do not show the same view: in " +
                            std::to_string(together.count) +
                            " frames, edges in depth lie no nearer to edges in colour than chance "
                            "would put them",
                        {{"agreement", together.mean}},
                        "check which colour image belongs to which depth image, and whether depth "
                        "is registered to colour"});
  else
    checkRegistration(sample, findings);
}

} // namespace bundle_icp
