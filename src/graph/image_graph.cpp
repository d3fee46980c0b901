// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/image_graph.h>

#include "graph/moving_features.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/graph/adjacency_list.hpp>

#include <algorithm>
#include <optional>
#include <set>

namespace bundle_icp {
namespace {

struct Node {
  ImageNode frame;
  std::size_t correspondences = 0;
  bool is_key = false;
  std::string exclusion;
};

using Graph = boost::adjacency_list<boost::vecS, boost::vecS, boost::undirectedS, Node, FramePair>;
using Candidates = std::set<std::pair<std::size_t, std::size_t>>;

void
insert(Candidates& candidates, std::size_t i, std::size_t j)
{
  if (i != j)
    candidates.emplace(std::min(i, j), std::max(i, j));
}

} // namespace

struct ImageGraph::Impl {
  CameraIntrinsics camera;
  ImageGraphOptions options;
  Graph graph;
  std::optional<ImageRetrieval> retrieval;
  bool has_descriptors = true;

  std::vector<const Features*>
  allFeatures() const
  {
    std::vector<const Features*> features;
    for (std::size_t i = 0; i < boost::num_vertices(graph); ++i)
      features.push_back(&graph[i].frame.features);
    return features;
  }

  void
  addTemporalCandidates(std::size_t first_new, Candidates& candidates) const;

  void
  addSimilarCandidates(std::size_t first_new, Candidates& candidates);

  Candidates
  chooseCandidates(std::size_t first_new, bool ordered_in_time);

  void
  excludeFrames();
};

bool
ImageGraphOptions::isValid(std::string* error) const
{
  std::string reason;
  if (!(min_relative_sharpness >= 0 && min_relative_sharpness < 1))
    reason = "min_relative_sharpness must lie in [0, 1)";
  else if (!(key_similarity >= 0 && key_similarity < 1))
    reason = "key_similarity must lie in [0, 1)";
  else if (num_similar < 1 || num_similar_keys < 1)
    reason = "num_similar and num_similar_keys must be >= 1";
  else
    matching.isValid(&reason) && retrieval.isValid(&reason);
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

ImageGraph::ImageGraph(const CameraIntrinsics& camera, const ImageGraphOptions& options)
: impl_(new Impl)
{
  std::string error;
  if (!options.isValid(&error) || !camera.isValid(&error))
    throw BadArgumentException("ImageGraph: " + error);
  impl_->camera = camera;
  impl_->options = options;
}

ImageGraph::~ImageGraph() = default;
ImageGraph::ImageGraph(ImageGraph&&) noexcept = default;
ImageGraph&
ImageGraph::operator=(ImageGraph&&) noexcept = default;

void
ImageGraph::Impl::addTemporalCandidates(std::size_t first_new, Candidates& candidates) const
{
  std::vector<std::size_t> by_time(boost::num_vertices(graph));
  for (std::size_t i = 0; i < by_time.size(); ++i)
    by_time[i] = i;
  std::stable_sort(by_time.begin(), by_time.end(), [this](std::size_t a, std::size_t b) {
    return graph[a].frame.timestamp < graph[b].frame.timestamp;
  });
  for (std::size_t k = 0; k < by_time.size(); ++k)
    for (std::size_t step = 1; step <= options.num_neighbours_in_time; ++step)
      if (k + step < by_time.size() && std::max(by_time[k], by_time[k + step]) >= first_new)
        insert(candidates, by_time[k], by_time[k + step]);
}

void
ImageGraph::Impl::addSimilarCandidates(std::size_t first_new, Candidates& candidates)
{
  const std::size_t count = boost::num_vertices(graph);
  if (!retrieval)
    retrieval.emplace(allFeatures(), options.retrieval);
  while (retrieval->size() < count)
    retrieval->add(graph[retrieval->size()].frame.features);

  // The sharpest frame first: a cover that starts with a bad one would keep it.
  std::size_t sharpest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    graph[i].is_key = false;
    if (graph[i].frame.features.sharpness > graph[sharpest].frame.features.sharpness)
      sharpest = i;
  }
  const std::vector<std::size_t> keys =
      retrieval->cover(sharpest, options.key_similarity * retrieval->typicalSimilarity());
  for (const std::size_t key : keys)
    graph[key].is_key = true;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t similar = graph[i].is_key ? options.num_similar_keys : options.num_similar;
    for (const std::size_t j : retrieval->mostSimilar(i, keys, similar))
      if (std::max(i, j) >= first_new)
        insert(candidates, i, j);
  }
}

Candidates
ImageGraph::Impl::chooseCandidates(std::size_t first_new, bool ordered_in_time)
{
  const std::size_t count = boost::num_vertices(graph);
  Candidates candidates;
  if (count <= options.exhaustive_limit) {
    for (std::size_t j = first_new; j < count; ++j) {
      graph[j].is_key = true;
      for (std::size_t i = 0; i < j; ++i)
        insert(candidates, i, j);
    }
    return candidates;
  }
  addSimilarCandidates(first_new, candidates);
  if (ordered_in_time)
    addTemporalCandidates(first_new, candidates);
  return candidates;
}

void
ImageGraph::Impl::excludeFrames()
{
  for (std::size_t i = 0; i < boost::num_vertices(graph); ++i) {
    Node& node = graph[i];
    std::vector<double> sharpness;
    const auto [begin, end] = boost::adjacent_vertices(i, graph);
    for (auto neighbour = begin; neighbour != end; ++neighbour)
      sharpness.push_back(graph[*neighbour].frame.features.sharpness);
    node.exclusion.clear();
    if (sharpness.empty()) {
      node.exclusion = "no other image shares " + std::to_string(options.matching.min_matches) +
                       " verified matches with it (" + std::to_string(node.frame.features.size()) +
                       " features)";
      continue;
    }
    std::nth_element(sharpness.begin(), sharpness.begin() + sharpness.size() / 2, sharpness.end());
    const double relative = node.frame.features.sharpness / sharpness[sharpness.size() / 2];
    if (relative < options.min_relative_sharpness)
      node.exclusion = "blurred: sharpness is " + std::to_string(int(100 * relative)) +
                       " % of that of its neighbours";
  }
}

bool
ImageGraph::append(std::vector<ImageNode> frames, bool ordered_in_time,
                   const ProgressCallback& progress, MatchStore* store)
{
  if (!impl_->has_descriptors)
    throw BadArgumentException(
        "ImageGraph: the descriptors were released; no image can be appended");
  Graph& graph = impl_->graph;
  const std::size_t first_new = boost::num_vertices(graph);
  for (ImageNode& frame : frames) {
    Node node;
    node.frame = std::move(frame);
    boost::add_vertex(std::move(node), graph);
  }
  const Candidates candidates = impl_->chooseCandidates(first_new, ordered_in_time);
  bool completed = true;
  const ProgressCallback watch = [&](const Progress& p) {
    completed = !progress || progress(p);
    return completed;
  };
  const std::vector<const Features*> features = impl_->allFeatures();
  std::vector<FramePair> pairs =
      matchPairs(features, impl_->camera, {candidates.begin(), candidates.end()},
                 impl_->options.matching, watch, store);
  separateMotions(features, impl_->camera, pairs);
  for (FramePair& pair : pairs) {
    graph[pair.first].correspondences += pair.matches.size();
    graph[pair.second].correspondences += pair.matches.size();
    const std::size_t first = pair.first, second = pair.second;
    // Given to add_edge(), the pair would be copied, and all matches would lie in memory twice.
    graph[boost::add_edge(first, second, graph).first] = std::move(pair);
  }
  impl_->excludeFrames();
  return completed;
}

void
ImageGraph::releaseDescriptors(bool keep_key_frames)
{
  impl_->has_descriptors = false;
  impl_->retrieval.reset();
  for (std::size_t i = 0; i < size(); ++i)
    if (!keep_key_frames || !isKey(i))
      impl_->graph[i].frame.features.descriptors.release();
}

std::size_t
ImageGraph::size() const
{
  return boost::num_vertices(impl_->graph);
}

const CameraIntrinsics&
ImageGraph::camera() const
{
  return impl_->camera;
}

const Features&
ImageGraph::features(std::size_t frame) const
{
  return impl_->graph[frame].frame.features;
}

double
ImageGraph::timestamp(std::size_t frame) const
{
  return impl_->graph[frame].frame.timestamp;
}

const std::optional<PosePrior>&
ImageGraph::prior(std::size_t frame) const
{
  return impl_->graph[frame].frame.prior;
}

std::vector<ImageEdge>
ImageGraph::edges(std::size_t frame) const
{
  std::vector<ImageEdge> result;
  const auto [begin, end] = boost::out_edges(frame, impl_->graph);
  for (auto edge = begin; edge != end; ++edge)
    result.push_back({boost::target(*edge, impl_->graph), &impl_->graph[*edge]});
  std::sort(result.begin(), result.end(),
            [](const ImageEdge& a, const ImageEdge& b) { return a.neighbour < b.neighbour; });
  return result;
}

std::size_t
ImageGraph::numEdges() const
{
  return boost::num_edges(impl_->graph);
}

std::size_t
ImageGraph::correspondences(std::size_t frame) const
{
  return impl_->graph[frame].correspondences;
}

bool
ImageGraph::isKey(std::size_t frame) const
{
  return impl_->graph[frame].is_key;
}

const std::string&
ImageGraph::exclusion(std::size_t frame) const
{
  return impl_->graph[frame].exclusion;
}

} // namespace bundle_icp
