// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/verification.h"

#include "common/by_time.h"
#include "common/parallel.h"
#include "refinement/pose_evidence.h"
#include "refinement/spread.h"
#include "refinement/verification_findings.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

namespace bundle_icp {
namespace {

/** Pairs of a frame whose matches are looked at: those with most matches. */
constexpr std::size_t MAX_PAIRS = 12;
/** Frames whose depth a frame's depth is compared with. */
constexpr std::size_t MAX_NEIGHBOURS = 5;
/** Displacements up to this many sigmas of a single matched point are none: errors that an image
 *  has as a whole reach it. */
constexpr double MAX_DISPLACEMENT = 1;
/** Displacements beyond this are doubtful even where the whole scan is so. */
constexpr double DOUBTFUL_DISPLACEMENT = 2;
/** Fewer matches may all be false. */
constexpr std::size_t MANY_MATCHES = 50;
/** Depth of which less agrees is doubtful even where the whole scan is so. */
constexpr double MIN_AGREEMENT = 0.5;
/** Depth of which more agrees is not doubtful, however well that of the others agrees. */
constexpr double GOOD_AGREEMENT = 0.75;
/** Fewer compared pixels say nothing. */
constexpr double MIN_COMPARED = 100;
/** Standard deviations of the scan's frames beyond which a frame is not one of them. */
constexpr double MAX_DEVIATIONS = 6;

/** Two frames of a component and what they say of each other's poses. */
struct Link {
  std::size_t first = 0, second = 0;
  const FramePair* pair = nullptr; ///< null: they share no edge
  bool compares_depth = false;
  double displacement = 0;
  DepthAgreement depth; ///< in both directions

  std::size_t
  numMatches() const
  {
    return pair ? pair->matches.size() : 0;
  }
};

class Verifier {
public:
  Verifier(const ImageGraph& graph, const SparseModel& model,
           const std::function<std::shared_ptr<const DepthView>(std::size_t)>& depth_views,
           int num_threads)
  : graph_(graph), model_(model), depth_views_(depth_views), num_threads_(num_threads),
    links_of_(graph.size()), frames_(graph.size())
  {
  }

  std::vector<VerifiedFrame>
  run();

  /** Of the pairs of many matches between good frames, after run(). */
  PairCounts
  countPairs() const;

private:
  std::vector<ImageEdge>
  strongestEdges(std::size_t frame) const;
  std::vector<std::size_t>
  neighboursInTime(std::size_t frame) const;
  void
  addLink(std::size_t a, std::size_t b, const FramePair* pair, bool compares_depth);
  void
  makeLinks();
  void
  measure();
  double
  displacement(std::size_t frame) const;
  DepthAgreement
  agreement(std::size_t frame) const;
  void
  doubtDisplaced();
  void
  doubtContradicted();
  void
  doubtUnsupported();
  void
  keepRefutedOfBadScan();
  template <class Score>
  void
  doubtWorstFirst(double bound, double refuting, const Score& score, const std::string& doubt);

  const ImageGraph& graph_;
  const SparseModel& model_;
  const std::function<std::shared_ptr<const DepthView>(std::size_t)>& depth_views_;
  const int num_threads_;
  std::vector<std::size_t> registered_; ///< in the order of time
  std::vector<Link> links_;
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> link_between_;
  std::vector<std::vector<std::size_t>> links_of_;
  std::vector<VerifiedFrame> frames_;
};

/** To frames of the same component. */
std::vector<ImageEdge>
Verifier::strongestEdges(std::size_t frame) const
{
  std::vector<ImageEdge> edges;
  for (const ImageEdge& edge : graph_.edges(frame))
    if (model_.component(edge.neighbour) == model_.component(frame))
      edges.push_back(edge);
  std::stable_sort(edges.begin(), edges.end(), [](const ImageEdge& a, const ImageEdge& b) {
    return a.pair->matches.size() > b.pair->matches.size();
  });
  edges.resize(std::min(edges.size(), MAX_PAIRS));
  return edges;
}

void
Verifier::addLink(std::size_t a, std::size_t b, const FramePair* pair, bool compares_depth)
{
  const auto key = std::minmax(a, b);
  const auto [found, is_new] = link_between_.try_emplace(key, links_.size());
  if (is_new) {
    links_.push_back({key.first, key.second, pair, compares_depth, 0, {}});
    links_of_[a].push_back(found->second);
    links_of_[b].push_back(found->second);
  }
  links_[found->second].compares_depth |= compares_depth;
}

void
Verifier::makeLinks()
{
  registered_ = byTime(graph_, model_.registeredFrames());
  for (std::size_t k = 0; k < registered_.size(); ++k) {
    const std::size_t frame = registered_[k];
    const std::vector<ImageEdge> edges = strongestEdges(frame);
    for (std::size_t e = 0; e < edges.size(); ++e)
      addLink(frame, edges[e].neighbour, edges[e].pair, e < MAX_NEIGHBOURS);
    // Frames without matches were placed by those before and after them.
    for (std::size_t d = 1; edges.empty() && d <= 2; ++d)
      for (const std::size_t other : {k - d, k + d})
        if (other < registered_.size() &&
            model_.component(registered_[other]) == model_.component(frame))
          addLink(frame, registered_[other], nullptr, true);
  }
}

void
Verifier::measure()
{
  parallelFor(links_.size(), num_threads_, {}, [this](std::size_t k) {
    Link& link = links_[k];
    if (link.pair)
      link.displacement = displacementByMatches(graph_, model_, *link.pair);
    if (!link.compares_depth)
      return;
    const auto first = depth_views_(link.first), second = depth_views_(link.second);
    const Pose first_from_second =
        model_.worldFromDepth(link.first).inverse() * model_.worldFromDepth(link.second);
    link.depth = compareDepth(*first, *second, first_from_second.inverse());
    link.depth += compareDepth(*second, *first, first_from_second);
  });
}

/** Median over the pairs with frames that are not doubtful, by number of matches; 0 = no pair. */
double
Verifier::displacement(std::size_t frame) const
{
  std::vector<std::pair<double, std::size_t>> pairs;
  std::size_t total = 0;
  for (const std::size_t k : links_of_[frame]) {
    const Link& link = links_[k];
    const std::size_t other = link.first == frame ? link.second : link.first;
    if (!link.pair || frames_[other].verdict == FrameVerdict::DOUBTFUL)
      continue;
    pairs.emplace_back(link.displacement, link.numMatches());
    total += link.numMatches();
  }
  std::sort(pairs.begin(), pairs.end());
  std::size_t sum = 0;
  for (const auto& [displacement, matches] : pairs)
    if (2 * (sum += matches) >= total)
      return displacement;
  return 0;
}

/** With frames that are not doubtful. */
DepthAgreement
Verifier::agreement(std::size_t frame) const
{
  DepthAgreement sum;
  for (const std::size_t k : links_of_[frame]) {
    const std::size_t other = links_[k].first == frame ? links_[k].second : links_[k].first;
    if (frames_[other].verdict != FrameVerdict::DOUBTFUL)
      sum += links_[k].depth;
  }
  return sum;
}

/** Makes the frame of the highest score doubtful until none lies above the bound. */
template <class Score>
void
Verifier::doubtWorstFirst(double bound, double refuting, const Score& score,
                          const std::string& doubt)
{
  std::vector<double> scores(graph_.size(), 0);
  for (const std::size_t frame : registered_)
    if (frames_[frame].verdict == FrameVerdict::GOOD)
      scores[frame] = score(frame);
  while (true) {
    const std::size_t worst =
        std::size_t(std::max_element(scores.begin(), scores.end()) - scores.begin());
    if (scores.empty() || !(scores[worst] > bound))
      return;
    frames_[worst].verdict = FrameVerdict::DOUBTFUL;
    frames_[worst].refuted = scores[worst] > refuting;
    std::ostringstream text;
    text.precision(2);
    text << doubt << scores[worst];
    frames_[worst].doubt = text.str();
    scores[worst] = 0;
    for (const std::size_t k : links_of_[worst]) {
      const std::size_t other = links_[k].first == worst ? links_[k].second : links_[k].first;
      if (frames_[other].verdict == FrameVerdict::GOOD)
        scores[other] = score(other);
    }
  }
}

void
Verifier::doubtDisplaced()
{
  std::vector<double> displacements;
  for (const std::size_t frame : registered_) {
    frames_[frame].displacement = displacement(frame);
    displacements.push_back(frames_[frame].displacement);
  }
  const Spread spread = spreadOf(displacements);
  const double bound = std::clamp(spread.median + MAX_DEVIATIONS * spread.deviation,
                                  MAX_DISPLACEMENT, DOUBTFUL_DISPLACEMENT);
  doubtWorstFirst(
      bound, DOUBTFUL_DISPLACEMENT, [this](std::size_t frame) { return displacement(frame); },
      "its matches want it displaced, in standard deviations of a match: ");
}

void
Verifier::doubtContradicted()
{
  const auto disagreement = [this](std::size_t frame) {
    const DepthAgreement sum = agreement(frame);
    return sum.compared() < MIN_COMPARED ? 0 : 1 - sum.agree / sum.compared();
  };
  std::vector<double> disagreements;
  for (const std::size_t frame : registered_)
    disagreements.push_back(disagreement(frame));
  const Spread spread = spreadOf(disagreements);
  doubtWorstFirst(std::clamp(spread.median + MAX_DEVIATIONS * spread.deviation, 1 - GOOD_AGREEMENT,
                             1 - MIN_AGREEMENT),
                  1 - MIN_AGREEMENT, disagreement,
                  "share of its depth in free space of other frames: ");
}

/** A pose that nothing contradicts, because nothing is compared with it, is not a good one. */
void
Verifier::doubtUnsupported()
{
  for (const std::size_t frame : registered_) {
    VerifiedFrame& verified = frames_[frame];
    const auto& links = links_of_[frame];
    const bool has_pair = std::any_of(links.begin(), links.end(), [&](std::size_t k) {
      const std::size_t other = links_[k].first == frame ? links_[k].second : links_[k].first;
      return links_[k].pair && frames_[other].verdict == FrameVerdict::GOOD;
    });
    if (verified.verdict == FrameVerdict::GOOD && !has_pair &&
        agreement(frame).compared() < MIN_COMPARED) {
      verified.verdict = FrameVerdict::DOUBTFUL;
      verified.doubt = "no other frame with a good pose shows what it shows";
      verified.refuted = true;
    }
  }
}

/** Where many frames are refuted, nothing says which of them are right. */
void
Verifier::keepRefutedOfBadScan()
{
  const auto refuted = std::count_if(frames_.begin(), frames_.end(),
                                     [](const VerifiedFrame& frame) { return frame.refuted; });
  if (double(refuted) >= MANY_FRAMES * double(registered_.size()))
    for (VerifiedFrame& frame : frames_)
      frame.refuted = false;
}

std::vector<VerifiedFrame>
Verifier::run()
{
  makeLinks();
  measure();
  for (const std::size_t frame : registered_)
    frames_[frame].verdict = FrameVerdict::GOOD;
  doubtDisplaced();
  doubtContradicted();
  doubtUnsupported();
  for (const std::size_t frame : registered_) {
    const DepthAgreement sum = agreement(frame);
    VerifiedFrame& verified = frames_[frame];
    if (sum.compared() > 0)
      verified.depth_agreement = sum.agree / sum.compared();
    // Its matches may have made it doubtful before its depth was looked at.
    verified.refuted |= verified.verdict == FrameVerdict::DOUBTFUL &&
                        sum.compared() >= MIN_COMPARED && *verified.depth_agreement < MIN_AGREEMENT;
  }
  keepRefutedOfBadScan();
  return frames_;
}

PairCounts
Verifier::countPairs() const
{
  PairCounts counts;
  for (const Link& link : links_)
    if (link.numMatches() >= MANY_MATCHES && frames_[link.first].verdict == FrameVerdict::GOOD &&
        frames_[link.second].verdict == FrameVerdict::GOOD) {
      ++counts.compared;
      counts.contradicted += link.displacement > DOUBTFUL_DISPLACEMENT;
    }
  return counts;
}

} // namespace

Verification
verifyPoses(const ImageGraph& graph, const SparseModel& model,
            const std::function<std::shared_ptr<const DepthView>(std::size_t)>& depth_views,
            bool has_times, int num_threads)
{
  Verification result;
  Verifier verifier(graph, model, depth_views, num_threads);
  result.frames = verifier.run();
  result.findings = poseFindings(graph, model, result.frames, verifier.countPairs(), has_times);
  return result;
}

} // namespace bundle_icp
