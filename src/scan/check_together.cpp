// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/check_together.h"

#include "scan/depth_placement.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>

namespace bundle_icp {
namespace {

/** Fewest frames with edges in depth and colour that say something, and those whose spread is
 *  known well. */
constexpr std::size_t FEWEST_FRAMES = 6, SPREAD_KNOWN = 12;
/** A mean so many of its standard deviations above 0, and so large, is no chance, though many
 *  places are tried: where depth lies right it is below 0 in all of them. */
constexpr double SURE = 3, MIN_GAIN_IN_TIME = 0.02, MIN_GAIN_IN_HALF = 0.04,
                 MIN_GAIN_IN_PLACE = 0.06;
/** Edges that lie right agree by more than this, ... */
constexpr double MIN_AGREEMENT = 0.13;
/** ... and edges that lie elsewhere have at most this share of it at their own place. */
constexpr double MOST_ELSEWHERE = 0.75;
/** Agreement of a chance, and the share of other views that agree better by chance. */
constexpr double CHANCE = 0.02, CHANCE_OF_BETTER = 0.15;
/** Depth may be so much earlier or later: cameras that run free at 30 Hz are paired within 17 ms,
 *  and exposure and transport add less [s]. Self-calibration finds it. */
constexpr double USUAL_OFFSET = 0.04;
/** Shifts up to this share of the image's width are mended by self-calibration, zooms are not. */
constexpr double FAR_SHIFT = 0.05;

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

/** What depth gains by lying on the colour of other frames, and how well it lies there. */
struct Gain : Mean {
  double agreement = 0;
};

/** Frames of a sample, from `begin` to before `end`. */
struct Window {
  std::size_t begin, end;
};

/** How much better the depth edges of each frame lie on the colour edges of the frame `shift`
 *  later in its run than on its own. */
Gain
gainOfShift(const FrameSample& sample, const Window& window, std::ptrdiff_t shift)
{
  std::vector<double> gains, there;
  for (std::size_t i = window.begin; i < window.end; ++i) {
    const std::ptrdiff_t j = std::ptrdiff_t(i) + shift;
    if (j < std::ptrdiff_t(window.begin) || j >= std::ptrdiff_t(window.end) ||
        std::ptrdiff_t(sample.places[std::size_t(j)]) - std::ptrdiff_t(sample.places[i]) !=
            shift * std::ptrdiff_t(sample.step))
      continue;
    const FrameLook &look = sample.looks[i], &other = sample.looks[std::size_t(j)];
    if (!look.depth_edges.empty() && !look.color_edges.empty() && !other.color_edges.empty()) {
      there.push_back(agreement(look, other));
      gains.push_back(there.back() - agreement(look, look));
    }
  }
  return {meanOf(gains), meanOf(there).mean};
}

struct Shift {
  std::ptrdiff_t frames = 0; ///< 0: none that is no chance
  Gain gain;
};

/** The shift of the largest gain. Frames that show one view are one witness. */
Shift
bestShift(const FrameSample& sample, const Window& window, double min_gain)
{
  Shift best{0, {{0, min_gain, 0}, 0}};
  const double repetition = std::sqrt(1 / shareOfDifferentViews(sample));
  const auto most = std::ptrdiff_t(window.end - window.begin) - 1;
  for (std::ptrdiff_t shift = -most; shift <= most; ++shift) {
    const Gain gain = gainOfShift(sample, window, shift);
    const double few =
        std::sqrt(double(SPREAD_KNOWN) / double(std::max<std::size_t>(1, gain.count)));
    if (shift != 0 && gain.mean > best.gain.mean &&
        gain.deviations > SURE * repetition * std::max(1.0, few))
      best = {shift, gain};
  }
  return best;
}

std::vector<double>
agreements(const std::vector<FrameLook>& looks, const DepthPlacement& placement = {})
{
  std::vector<double> values;
  for (const FrameLook& look : looks)
    values.push_back(agreement(look, placement));
  return values;
}

/** What a frame's depth lies on, if not on its own colour, and how well. */
struct Elsewhere {
  double agreement = 0;
  std::optional<Finding> finding;
};

/** Depth that lies on the colour of another frame, all the time or in a part of the recording. */
Elsewhere
otherMoment(const FrameSample& sample, double interval)
{
  if (withDifferentEdges(sample).size() < FEWEST_FRAMES)
    return {};
  const std::size_t number = sample.looks.size();
  const Window all{0, number}, halves[] = {{0, number / 2}, {number / 2, number}};
  Shift best = bestShift(sample, all, MIN_GAIN_IN_TIME);
  for (const Window& half : halves)
    if (const Shift shift = bestShift(sample, half, MIN_GAIN_IN_HALF);
        shift.gain.mean > best.gain.mean)
      best = shift;
  if (best.frames == 0 || best.gain.agreement < MIN_AGREEMENT)
    return {};
  const std::size_t frames = std::size_t(std::abs(best.frames)) * sample.step;
  if (interval > 0 && double(frames) * interval <= USUAL_OFFSET)
    return {best.gain.agreement, {}};
  return {best.gain.agreement,
          Finding{Severity::FAULT,
                  "color_and_depth",
                  "colour and depth are of other moments: edges in depth lie on those of the "
                  "colour image " +
                      std::to_string(frames) + (best.frames > 0 ? " later" : " earlier") +
                      ", not on those of their own",
                  {{"frames_apart", double(frames)}, {"deviations", best.gain.deviations}},
                  "pair the images by time"}};
}

/** Depth that lies elsewhere on its own colour. */
Elsewhere
otherPlace(const FrameSample& sample, int num_threads)
{
  const std::vector<FrameLook> views = withDifferentEdges(sample);
  if (views.size() < FEWEST_FRAMES)
    return {};
  const DepthPlacement best = bestPlacement(views, num_threads);
  const std::vector<double> own = agreements(views), placed = agreements(views, best);
  std::vector<double> gains;
  for (std::size_t i = 0; i < own.size(); ++i)
    gains.push_back(placed[i] - own[i]);
  const Mean here = meanOf(own), there = meanOf(placed), gain = meanOf(gains);
  if (gain.deviations < SURE || gain.mean < MIN_GAIN_IN_PLACE || there.mean < MIN_AGREEMENT ||
      here.mean > MOST_ELSEWHERE * there.mean)
    return {};
  const double scale = sample.pixels_per_edge_pixel, pixels = scale * cv::norm(best.shift);
  const bool is_far = best.flip != DepthPlacement::Flip::NONE || best.zoom != 1 ||
                      cv::norm(best.shift) > FAR_SHIFT * EDGE_WIDTH;
  return {
      there.mean,
      Finding{is_far ? Severity::FAULT : Severity::WARNING,
              "color_and_depth",
              "depth is not registered to colour: its edges lie on those in colour when it is " +
                  toString(best, scale),
              {{"shift_px", pixels}, {"zoom", best.zoom}, {"deviations", gain.deviations}},
              "record depth aligned to the colour camera"}};
}

/** Share of the other views whose colour edges the depth edges of a view lie on better than on its
 *  own: a half by chance. */
double
shareOfBetterViews(const std::vector<FrameLook>& views)
{
  double better = 0;
  for (const FrameLook& view : views)
    for (const FrameLook& other : views)
      better += agreement(view, other) > agreement(view, view);
  return better / double(views.size() * (views.size() - 1));
}

void
checkView(const FrameSample& sample, std::vector<Finding>& findings)
{
  const std::vector<FrameLook> views = withDifferentEdges(sample);
  if (views.size() < FEWEST_FRAMES)
    return;
  const Mean own = meanOf(agreements(views));
  const double better = shareOfBetterViews(views);
  if (own.mean > CHANCE && better < CHANCE_OF_BETTER)
    return;
  findings.push_back({Severity::FAULT,
                      "color_and_depth",
                      "colour and depth do not show the same view: edges in depth lie as well on "
                      "edges in the colour of " +
                          std::to_string(int(std::lround(100 * better))) + " % of the other frames",
                      {{"agreement", own.mean}, {"share_of_better_frames", better}},
                      "check which colour image belongs to which depth image, and whether depth is "
                      "registered to colour"});
}

} // namespace

void
checkTogether(const FrameSample& sample, double interval, int num_threads,
              std::vector<Finding>& findings)
{
  const Elsewhere moment = otherMoment(sample, interval), place = otherPlace(sample, num_threads);
  const Elsewhere& likelier = moment.agreement > place.agreement ? moment : place;
  if (likelier.finding)
    findings.push_back(*likelier.finding);
  else
    checkView(sample, findings);
}

} // namespace bundle_icp
