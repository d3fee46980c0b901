// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/feature_matching.h>

#include "common/array_store.h"
#include "common/parallel.h"
#include "graph/descriptor_products.h"
#include "graph/descriptor_tree.h"
#include "graph/pair_blocks.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>

namespace bundle_icp {
namespace {

/** Square of RootSIFT's norm in the units of Features::descriptors. */
constexpr std::int32_t SQUARED_NORM = 256 * 256;
/** So many times as far as inliers may be lies what moves otherwise. */
constexpr double FAR = 3;

/** Of unit vectors: |a - b|^2 / 2 = 1 - a b. Rounded descriptors may be a little longer than one:
 *  a negative distance would turn the ratio test around. */
std::int32_t
halfSquaredDistance(std::int32_t product)
{
  return std::max(SQUARED_NORM - product, 0);
}

/** Descriptors prepared for many matchings; which member is set depends on the back end. */
struct PreparedDescriptors {
  std::unique_ptr<PackedDescriptors> packed;
  std::unique_ptr<DescriptorTree> tree;
};

PreparedDescriptors
prepare(const cv::Mat& descriptors, const MatchingOptions& options)
{
  PreparedDescriptors prepared;
  if (options.backend == MatchingBackend::EXACT)
    prepared.packed = std::make_unique<PackedDescriptors>(descriptors);
  else
    prepared.tree = std::make_unique<DescriptorTree>(descriptors);
  return prepared;
}

/** What a frame takes while it is matched [bytes]: its descriptors as they are and prepared. */
std::size_t
bytesInUse(const cv::Mat& descriptors, MatchingBackend backend)
{
  // A tree holds them as floats, in a cloud and in the rows that FLANN sorts.
  const std::size_t copies = backend == MatchingBackend::EXACT ? 2 : 1 + 2 * sizeof(float);
  return copies * descriptors.total();
}

/** For each descriptor of `second` that was matched the nearest in the tree, -1 for all others. */
std::vector<int>
nearestOfMatched(const DescriptorTree& first, const cv::Mat& second,
                 const std::vector<FeatureMatch>& matches)
{
  cv::Mat queries;
  for (const FeatureMatch& match : matches)
    queries.push_back(second.row(match.second));
  const std::vector<BestProducts> best = first.bestProducts(queries);
  std::vector<int> nearest(second.rows, -1);
  for (std::size_t k = 0; k < matches.size(); ++k)
    nearest[matches[k].second] = best[k].index;
  return nearest;
}

std::vector<FeatureMatch>
match(const cv::Mat& first, const cv::Mat& second, const PreparedDescriptors& first_prepared,
      const PreparedDescriptors& second_prepared, const MatchingOptions& options)
{
  std::vector<FeatureMatch> matches;
  if (first.rows == 0 || second.rows < 2)
    return matches;
  std::vector<BestProducts> rows;
  std::vector<int> columns;
  if (second_prepared.packed)
    bestProducts(first, *second_prepared.packed, rows, columns);
  else
    rows = second_prepared.tree->bestProducts(first);
  const double squared_ratio = options.ratio * options.ratio;
  for (int i = 0; i < first.rows; ++i)
    if (rows[i].index >= 0 &&
        halfSquaredDistance(rows[i].best) < squared_ratio * halfSquaredDistance(rows[i].second))
      matches.push_back({i, rows[i].index});
  if (first_prepared.tree)
    columns = nearestOfMatched(*first_prepared.tree, second, matches);
  matches.erase(std::remove_if(matches.begin(), matches.end(),
                               [&](const FeatureMatch& m) { return columns[m.second] != m.first; }),
                matches.end());
  return matches;
}

/** Matches that can be aligned, and their points. */
struct MeasuredMatches {
  std::vector<FeatureMatch> matches;
  std::vector<PointPair> points;
};

/** The motion that most of the matches agree on; no matches when fewer than options.min_matches. */
FramePair
alignMatches(const MeasuredMatches& measured, const MatchingOptions& options)
{
  FramePair pair;
  if (measured.points.size() < options.min_matches)
    return pair;
  const RigidAlignment alignment = robustRigidAlignment(measured.points, options.verification);
  if (!alignment.success || alignment.inliers.size() < options.min_matches)
    return pair;
  pair.first_from_second = alignment.target_from_source;
  pair.matches.reserve(alignment.inliers.size());
  for (const std::size_t k : alignment.inliers)
    pair.matches.push_back(measured.matches[k]);
  return pair;
}

/** The matches that lie far from a motion, not only in the tail of its errors. */
MeasuredMatches
farFrom(const Pose& first_from_second, const MeasuredMatches& measured, double inlier_sigmas)
{
  MeasuredMatches far;
  for (std::size_t k = 0; k < measured.points.size(); ++k) {
    const PointPair& points = measured.points[k];
    const double distance = (first_from_second * points.source - points.target).norm();
    if (distance * std::sqrt(points.weight) > FAR * inlier_sigmas) {
      far.matches.push_back(measured.matches[k]);
      far.points.push_back(points);
    }
  }
  return far;
}

/** Descriptors of the frames of a block, prepared; those of frames that are not in the next block
 *  are dropped. */
class BlockDescriptors {
public:
  BlockDescriptors(const std::vector<const Features*>& features, const MatchingOptions& options)
  : features_(features), options_(options), prepared_(features.size())
  {
  }

  void
  setFrames(const std::vector<std::size_t>& frames)
  {
    std::vector<std::size_t> added;
    std::set_difference(frames.begin(), frames.end(), frames_.begin(), frames_.end(),
                        std::back_inserter(added));
    for (const std::size_t frame : frames_)
      if (!std::binary_search(frames.begin(), frames.end(), frame)) {
        prepared_[frame] = {};
        releaseMemory(features_[frame]->descriptors);
      }
    frames_ = frames;
    parallelFor(added.size(), options_.num_threads, {}, [&](std::size_t k) {
      prepared_[added[k]] = prepare(features_[added[k]]->descriptors, options_);
    });
  }

  std::vector<FeatureMatch>
  match(std::size_t i, std::size_t j) const
  {
    return bundle_icp::match(features_[i]->descriptors, features_[j]->descriptors, prepared_[i],
                             prepared_[j], options_);
  }

private:
  const std::vector<const Features*>& features_;
  const MatchingOptions& options_;
  std::vector<PreparedDescriptors> prepared_;
  std::vector<std::size_t> frames_; ///< whose descriptors are prepared, ascending
};

std::vector<PairBlock>
blocksOf(const std::vector<const Features*>& features,
         const std::vector<std::pair<std::size_t, std::size_t>>& candidates,
         const MatchingOptions& options)
{
  std::vector<std::size_t> bytes;
  for (const Features* frame : features)
    bytes.push_back(bytesInUse(frame->descriptors, options.backend));
  return blocksOfPairs(bytes, candidates, options.max_memory);
}

void
checkArguments(std::size_t num_features,
               const std::vector<std::pair<std::size_t, std::size_t>>& candidates,
               const MatchingOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("matchPairs: " + error);
  for (const auto& [i, j] : candidates)
    if (i >= num_features || j >= num_features || i == j)
      throw BadArgumentException("matchPairs: candidate pair " + std::to_string(i) + ", " +
                                 std::to_string(j) + " of " + std::to_string(num_features) +
                                 " images");
}

} // namespace

std::string
toString(MatchingBackend backend)
{
  return backend == MatchingBackend::EXACT ? "exact" : "kdtree";
}

std::optional<MatchingBackend>
parseMatchingBackend(const std::string& name)
{
  for (const MatchingBackend backend : {MatchingBackend::EXACT, MatchingBackend::KDTREE})
    if (toString(backend) == name)
      return backend;
  return std::nullopt;
}

bool
MatchingOptions::isValid(std::string* error) const
{
  std::string reason;
  if (!(ratio > 0 && ratio <= 1))
    reason = "ratio must lie in (0, 1]";
  else if (min_matches < 3)
    reason = "min_matches must be >= 3";
  else if (num_threads < 0)
    reason = "num_threads must be >= 0";
  else
    verification.isValid(&reason);
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

std::vector<FeatureMatch>
matchDescriptors(const cv::Mat& first, const cv::Mat& second, const MatchingOptions& options)
{
  return match(first, second, prepare(first, options), prepare(second, options), options);
}

FramePair
verifyMatches(const Features& first, const Features& second,
              const std::vector<FeatureMatch>& putative, const CameraIntrinsics& camera,
              const MatchingOptions& options)
{
  MeasuredMatches measured;
  for (const FeatureMatch& m : putative) {
    if (!first.hasDepth(m.first) || !second.hasDepth(m.second))
      continue;
    measured.matches.push_back(m);
    measured.points.push_back(
        {pointInCamera(second, m.second, camera), pointInCamera(first, m.first, camera),
         1 / (pointVariance(first, m.first, camera) + pointVariance(second, m.second, camera))});
  }
  FramePair pair = alignMatches(measured, options);
  if (!pair.matches.empty()) {
    FramePair other = alignMatches(
        farFrom(pair.first_from_second, measured, options.verification.inlier_sigmas), options);
    pair.matches_of_other_motion = std::move(other.matches);
    pair.other_first_from_second = other.first_from_second;
  }
  pair.num_putative = putative.size();
  return pair;
}

std::vector<FramePair>
matchPairs(const std::vector<const Features*>& features, const CameraIntrinsics& camera,
           const std::vector<std::pair<std::size_t, std::size_t>>& candidates,
           const MatchingOptions& options, const ProgressCallback& progress, MatchStore* store)
{
  checkArguments(features.size(), candidates, options);
  std::vector<FramePair> slots(candidates.size());
  BlockDescriptors descriptors(features, options);
  const auto find_matches = [&](std::size_t i, std::size_t j) {
    if (std::optional<FramePair> known = store ? store->find(i, j) : std::nullopt) {
      known->first = i;
      known->second = j;
      return std::move(*known);
    }
    FramePair pair =
        verifyMatches(*features[i], *features[j], descriptors.match(i, j), camera, options);
    pair.first = i;
    pair.second = j;
    if (store)
      store->add(pair);
    return pair;
  };
  std::size_t done = 0;
  ProgressCallback watch;
  if (progress)
    watch = [&](const Progress& p) {
      return progress({p.stage, done + p.done, candidates.size()});
    };
  for (const PairBlock& block : blocksOf(features, candidates, options)) {
    descriptors.setFrames(block.frames);
    const auto& pairs = block.candidates;
    if (!parallelFor(pairs.size(), options.num_threads, {"matching", watch}, [&](std::size_t k) {
          slots[pairs[k]] = find_matches(candidates[pairs[k]].first, candidates[pairs[k]].second);
        }))
      break;
    done += pairs.size();
  }
  descriptors.setFrames({});
  slots.erase(std::remove_if(slots.begin(), slots.end(),
                             [](const FramePair& pair) { return pair.matches.empty(); }),
              slots.end());
  return slots;
}

} // namespace bundle_icp
