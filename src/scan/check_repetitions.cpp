// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/check_repetitions.h"

#include "common/parallel.h"
#include "refinement/spread.h"
#include "scan/read_frame.h"

#include <bundle_icp/common/exceptions.h>

#include <opencv2/core.hpp>

#include <algorithm>

namespace bundle_icp {
namespace {

/** Whether a frame has the same images as the next one, bit for bit. */
struct Repetition {
  bool is_read = false, color = false, depth = false;
};

/** Of each frame of the sample. */
std::vector<Repetition>
findRepetitions(const RGBDDataset& dataset, const FrameSample& sample, int num_threads)
{
  std::vector<Repetition> repetitions(sample.looks.size());
  parallelFor(sample.looks.size(), num_threads, {}, [&](std::size_t i) {
    const FrameLook& look = sample.looks[i];
    const std::size_t next = sample.places[i] + 1;
    if (!look.is_read || next == sample.order.size())
      return;
    try {
      const RGBDFrame frame = readFrame(dataset, sample.order[next]);
      repetitions[i] = {true, look.contrast > 0 && hashOf(frame.color) == look.color_hash,
                        look.measured > 0 && hashOf(frame.depth) == look.depth_hash};
    }
    catch (const pcl::IOException&) {
      // An image that cannot be read is reported by the reconstruction, with its name.
    }
  });
  return repetitions;
}

/** Neighbours that repeat an image bit for bit, in recordings whose reader leaves them in. */
void
checkRepeated(const std::vector<Repetition>& repetitions, std::vector<Finding>& findings)
{
  std::size_t pairs = 0, color = 0, depth = 0;
  for (const Repetition& repetition : repetitions) {
    pairs += repetition.is_read;
    color += repetition.color && !repetition.depth;
    depth += repetition.depth && !repetition.color;
  }
  for (const auto& [count, name] :
       {std::make_pair(color, "colour"), std::make_pair(depth, "depth")})
    if (count > 1 && 5 * count > pairs)
      findings.push_back({Severity::WARNING,
                          "repeated_images",
                          std::to_string(count) + " of " + std::to_string(pairs) +
                              " neighbouring frames have the same " + name +
                              " image, bit for bit, while the other image is new",
                          {{"share", double(count) / double(pairs)}},
                          "leave out the repeated images"});
}

/** Pairs of neighbours whose first measure is far below what is usual, while the second one is as
 *  usual; 0 where these are too few to be more than chance. */
std::size_t
countFrozen(const std::vector<double>& staying, const std::vector<double>& moving)
{
  constexpr double stays = 0.2, moves = 0.6;
  std::vector<double> sorted = staying;
  std::sort(sorted.begin(), sorted.end());
  const double usual = sorted.empty() ? 0 : sorted[sorted.size() * 9 / 10];
  std::vector<double> of_frozen, of_others;
  for (std::size_t i = 0; i < staying.size(); ++i)
    (staying[i] < stays * usual ? of_frozen : of_others).push_back(moving[i]);
  const bool is_chance = of_frozen.size() < 3 || 5 * of_frozen.size() < staying.size();
  return is_chance || medianOf(of_frozen) < moves * medianOf(of_others) ? 0 : of_frozen.size();
}

/** Neighbours one of whose images stays while the other one moves on as elsewhere: images that were
 *  repeated, and then encoded or filtered anew. */
void
checkFrozen(const FrameSample& sample, std::vector<Finding>& findings)
{
  std::vector<double> grey, depth;
  for (std::size_t i = 1; i < sample.looks.size(); ++i) {
    const FrameLook &look = sample.looks[i], &before = sample.looks[i - 1];
    if (sample.places[i] != sample.places[i - 1] + 1 || !look.is_read || !before.is_read ||
        look.color_hash == before.color_hash || look.depth_hash == before.depth_hash)
      continue;
    if (look.depth_edges.empty() || before.depth_edges.empty())
      continue; // depth of a wall alone stays as it is
    grey.push_back(cv::mean(cv::abs(look.small_grey - before.small_grey))[0]);
    depth.push_back(1 - look.depth_edges.dot(before.depth_edges));
  }
  // Edges of depth flicker, also where the camera stands still.
  const double flicker = depth.empty() ? 0 : *std::min_element(depth.begin(), depth.end());
  std::vector<double> depth_beyond = depth;
  for (double& change : depth_beyond)
    change -= flicker;
  const auto check = [&](const std::vector<double>& staying, const std::string& name,
                         const std::vector<double>& moving, const std::string& other) {
    const std::size_t count = countFrozen(staying, moving);
    if (count > 0)
      findings.push_back({Severity::FAULT,
                          "repeated_images",
                          "in " + std::to_string(count) + " of " + std::to_string(staying.size()) +
                              " neighbouring frames the " + name +
                              " image stays as it was while the " + other + " image moves on",
                          {{"share", double(count) / double(staying.size())}},
                          "leave out the repeated images"});
  };
  check(grey, "colour", depth_beyond, "depth");
  check(depth, "depth", grey, "colour");
}

} // namespace

void
checkRepetitions(const RGBDDataset& dataset, const FrameSample& sample, int num_threads,
                 std::vector<Finding>& findings)
{
  checkRepeated(findRepetitions(dataset, sample, num_threads), findings);
  checkFrozen(sample, findings);
}

} // namespace bundle_icp
