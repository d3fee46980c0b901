// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "changes.h"
#include "inputs.h"

namespace adversity {
namespace {

using Change = std::function<void(Recording&)>;

/** Other moments. */
const char* const MOMENTS = "other moment|(earlier|later), not on those|do not show the same view";
/** Other pixels. */
const char* const PIXELS = "not registered|px beside|do not show the same view|mirror|upside|zoom";
const char* const REPEATED =
    "repeat|the same (colour|depth) image|stays as it was|twice|other moment";

Change
depthPixels(const PixelChange& change)
{
  return [=](Recording& r) { changePixels(r.depth, change); };
}

Change
depthMoved(double zoom, double dx, double dy)
{
  return depthPixels(
      [=](std::size_t, const cv::Mat& pixels) { return moved(pixels, zoom, dx, dy); });
}

/** Flips depth as cv::flip does. */
Change
depthFlipped(int code)
{
  return depthPixels([=](std::size_t, const cv::Mat& pixels) {
    cv::Mat result;
    cv::flip(pixels, result, code);
    return result;
  });
}

Change
depthLater(int frames)
{
  return [=](Recording& r) { shiftDepth(r, frames); };
}

/** Each image of a stream comes `times` times in place of the next ones, with new noise of a
 *  deviation above 0. What a frame shows at which moment is then told by the other stream. */
void
repeat(std::vector<Image>& images, std::size_t times, double deviation)
{
  const std::vector<Image> before = images;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const cv::Mat& pixels = before[i - i % times].pixels;
    images[i].pixels = deviation > 0 && i % times > 0 ? withNoise(pixels, deviation, i) : pixels;
  }
}

Change
colorRepeated(std::size_t times, double deviation)
{
  return [=](Recording& r) { repeat(r.color, times, deviation); };
}

/** Colour tells the moment of a frame: its place stays. */
Change
depthRepeated(std::size_t times, double deviation)
{
  return [=](Recording& r) { repeat(r.depth, times, deviation); };
}

void
depthShuffled(Recording& r)
{
  const std::vector<Image> depth = r.depth;
  for (std::size_t i = 0; i < depth.size(); ++i)
    r.depth[i].pixels = depth[(7 * i + 3) % depth.size()].pixels;
}

void
depthOfAnotherRecording(Recording& r)
{
  const Recording& other = baseRecording("other_table");
  for (std::size_t i = 0; i < r.depth.size(); ++i)
    r.depth[i].pixels = other.depth[i].pixels;
}

/** Depth of another recording in three frames. */
void
someDepthOfAnotherRecording(Recording& r)
{
  const Recording& other = baseRecording("other_table");
  for (const std::size_t i : {4, 11, 17})
    r.depth[i].pixels = other.depth[i].pixels;
}

/** A stream that stopped: its first image for ever. */
void
freeze(std::vector<Image>& images)
{
  for (Image& image : images)
    image.pixels = images.front().pixels;
}

} // namespace

std::vector<Input>
togetherInputs()
{
  const std::vector<std::string> table = {"table"}, both = {"table", "desk"},
                                 all = {"table", "walls", "desk"};
  const auto nothing = [](Recording&) {};
  return {
      {"depth_later", all, depthLater(1), MOMENTS, 0.5, true},
      {"depth_earlier", both, depthLater(-1), MOMENTS},
      {"depth_3_later", both, depthLater(3), MOMENTS},
      {"depth_3_earlier", all, depthLater(-3), MOMENTS},
      {"depth_half_a_frame_later", {"half_late"}, nothing, MOMENTS},
      {"depth_shuffled", both, depthShuffled, MOMENTS},
      {"depth_8_px_right", both, depthMoved(1, 8, 0), PIXELS},
      {"depth_20_px_right", both, depthMoved(1, 20, 0), PIXELS, 0.5, true},
      {"depth_25_px_down", table, depthMoved(1, 0, 25), PIXELS},
      {"depth_40_px_left", both, depthMoved(1, -40, 0), PIXELS},
      {"depth_zoomed", both, depthMoved(1.12, 0, 0), PIXELS},
      {"depth_zoomed_out", table, depthMoved(0.85, 0, 0), PIXELS},
      {"depth_zoomed_and_shifted", both, depthMoved(1.1, 15, -8), PIXELS},
      {"depth_mirrored", both, depthFlipped(1), PIXELS},
      {"depth_upside_down", both, depthFlipped(0), PIXELS},
      {"depth_turned_by_180", table, depthFlipped(-1), PIXELS},
      {"depth_of_another_recording", table, depthOfAnotherRecording, MOMENTS},
      {"some_depth_of_another_recording", table, someDepthOfAnotherRecording, MOMENTS},
      {"color_twice", both, colorRepeated(2, 0), REPEATED, 0.4, true, 2},
      {"color_thrice", table, colorRepeated(3, 0), REPEATED, 0.3, false, 3},
      {"color_twice_not_bit_equal", both, colorRepeated(2, 1.5), REPEATED, 0.4, false, 2},
      {"color_thrice_not_bit_equal", both, colorRepeated(3, 1.5), REPEATED, 0.3, false, 3},
      {"depth_twice", both, depthRepeated(2, 0), REPEATED, 0.4, false, 2},
      {"depth_thrice_not_bit_equal", table, depthRepeated(3, 5), REPEATED, 0.3, false, 3},
      {"color_frozen", table, [](Recording& r) { freeze(r.color); }, REPEATED},
      {"depth_frozen", both, [](Recording& r) { freeze(r.depth); }, REPEATED},
  };
}

} // namespace adversity
