// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/false_connections.h"

#include "common/parallel.h"

#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/connected_components.hpp>
#include <boost/graph/kruskal_min_spanning_tree.hpp>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace bundle_icp {
namespace {

/** An edge is contradicted when a smaller share of its matches agrees with the poses. */
constexpr double MIN_AGREEING_SHARE = 0.3;

using Matches = std::vector<FeatureMatch>;

/** An edge of the image graph between two frames of the component, as numbered here. */
struct Link {
  std::size_t first = 0;
  std::size_t second = 0;
  const FramePair* pair = nullptr;
  Matches agreeing;        ///< those that agree with the poses
  bool is_refuted = false; ///< contradicted, by more than speaks for it

  bool
  isContradicted() const
  {
    return double(agreeing.size()) < MIN_AGREEING_SHARE * double(pair->matches.size());
  }
};

/** The key frames of a component with the edges between them. */
class Connections {
public:
  Connections(const ImageGraph& graph, int component, const TrackOptions& options, int num_threads,
              SparseModel& model)
  : graph_(graph), max_squared_sigmas_(options.max_sigmas * options.max_sigmas),
    num_threads_(num_threads), model_(model)
  {
    std::map<std::size_t, std::size_t> number;
    for (const std::size_t frame : model.registeredFrames(component))
      if (graph.isKey(frame)) {
        number[frame] = frames_.size();
        frames_.push_back(frame);
      }
    for (const auto& [frame, i] : number)
      for (const ImageEdge& edge : graph.edges(frame))
        if (const auto other = number.find(edge.neighbour);
            other != number.end() && edge.pair->first == frame)
          links_.push_back({i, other->second, edge.pair, {}, false});
    moved_.resize(frames_.size(), 0);
    std::vector<Link*> all;
    for (Link& link : links_)
      all.push_back(&link);
    std::vector<Matches> agreeing = agreeingMatches(all, Pose::Identity());
    for (std::size_t k = 0; k < all.size(); ++k)
      all[k]->agreeing = std::move(agreeing[k]);
  }

  std::size_t
  correct()
  {
    // Moves that undo each other are not known of, but not ruled out either.
    for (std::size_t step = 0; step < links_.size(); ++step) {
      Link* const link = strongestContradiction();
      if (!link)
        break;
      if (!moveAcross(*link))
        link->is_refuted = true;
    }
    return std::size_t(std::count(moved_.begin(), moved_.end(), 1));
  }

private:
  using Graph =
      boost::adjacency_list<boost::vecS, boost::vecS, boost::undirectedS, boost::no_property,
                            boost::property<boost::edge_weight_t, double>>;

  std::vector<Link*>
  spanningTree();
  Link*
  strongestContradiction();
  std::vector<char>
  sideOfSecond(const Link& cut) const;
  std::vector<Matches>
  agreeingMatches(const std::vector<Link*>& links, const Pose& second_moved_by) const;
  std::size_t
  numPoints(const std::vector<Link*>& links, const std::vector<Matches>& matches,
            const std::vector<char>& is_second) const;
  bool
  moveAcross(const Link& link);

  const ImageGraph& graph_;
  const double max_squared_sigmas_;
  const int num_threads_;
  SparseModel& model_;
  std::vector<std::size_t> frames_;
  std::vector<Link> links_;
  std::vector<Link*> tree_;
  std::vector<char> moved_; ///< by frame
};

/** Of maximum number of matches. */
std::vector<Link*>
Connections::spanningTree()
{
  Graph weighted(frames_.size());
  std::map<Graph::edge_descriptor, Link*> link_of;
  for (Link& link : links_)
    if (!link.is_refuted)
      link_of[boost::add_edge(link.first, link.second, -double(link.pair->matches.size()), weighted)
                  .first] = &link;
  std::vector<Graph::edge_descriptor> edges;
  boost::kruskal_minimum_spanning_tree(weighted, std::back_inserter(edges));
  std::vector<Link*> tree;
  for (const Graph::edge_descriptor& edge : edges)
    tree.push_back(link_of.at(edge));
  return tree;
}

Link*
Connections::strongestContradiction()
{
  tree_ = spanningTree(); // Kruskal's algorithm takes the strongest edges first
  const auto found = std::find_if(tree_.begin(), tree_.end(),
                                  [](const Link* link) { return link->isContradicted(); });
  return found == tree_.end() ? nullptr : *found;
}

/** By frame, whether the tree connects it with the cut edge's second frame. */
std::vector<char>
Connections::sideOfSecond(const Link& cut) const
{
  Graph parts(frames_.size());
  for (const Link* link : tree_)
    if (link != &cut)
      boost::add_edge(link->first, link->second, parts);
  std::vector<int> part(frames_.size());
  boost::connected_components(parts, part.data());
  std::vector<char> side;
  for (const int p : part)
    side.push_back(p == part[cut.second]);
  return side;
}

/** For each edge, the matches that agree when its second frame is moved in the world. */
std::vector<Matches>
Connections::agreeingMatches(const std::vector<Link*>& links, const Pose& second_moved_by) const
{
  std::vector<Matches> agreeing(links.size());
  parallelFor(links.size(), num_threads_, {}, [&](std::size_t k) {
    const std::size_t first = frames_[links[k]->first], second = frames_[links[k]->second];
    const Features &first_features = graph_.features(first),
                   &second_features = graph_.features(second);
    for (const FeatureMatch& match : links[k]->pair->matches) {
      const Eigen::Vector3d difference =
          measuredPoint(graph_, model_, {first, match.first}) -
          second_moved_by * measuredPoint(graph_, model_, {second, match.second});
      const double variance =
          pointVariance(first_features, std::size_t(match.first), graph_.camera()) +
          pointVariance(second_features, std::size_t(match.second), graph_.camera());
      if (difference.squaredNorm() < max_squared_sigmas_ * variance)
        agreeing[k].push_back(match);
    }
  });
  return agreeing;
}

/** Number of scene points that the matches show, however many frames show them: by tracks, in the
 *  frames of the side with fewer frames. */
std::size_t
Connections::numPoints(const std::vector<Link*>& links, const std::vector<Matches>& matches,
                       const std::vector<char>& is_second) const
{
  std::set<std::pair<int, int>> points[2];
  const auto add = [&](std::size_t i, int feature) {
    const int point = model_.pointOf(frames_[i], feature);
    points[is_second[i] ? 1 : 0].insert(point >= 0 ? std::pair(-1, point)
                                                   : std::pair(int(i), feature));
  };
  for (std::size_t k = 0; k < links.size(); ++k)
    for (const FeatureMatch& match : matches[k]) {
      add(links[k]->first, match.first);
      add(links[k]->second, match.second);
    }
  return std::min(points[0].size(), points[1].size());
}

/** Moves the smaller part that an edge of the tree connects, if both parts then share more
 *  points. */
bool
Connections::moveAcross(const Link& link)
{
  const std::vector<char> is_second = sideOfSecond(link);
  const Pose second_moved_by = model_.worldFromCamera(frames_[link.first]) *
                               link.pair->first_from_second *
                               model_.worldFromCamera(frames_[link.second]).inverse();
  std::vector<Link*> between;
  std::vector<Matches> before, after;
  for (const bool forward : {true, false}) { // by the side of an edge's second frame
    std::vector<Link*> links;
    for (Link& other : links_)
      if (is_second[other.first] != is_second[other.second] &&
          bool(is_second[other.second]) == forward)
        links.push_back(&other);
    for (Matches& agreeing :
         agreeingMatches(links, forward ? second_moved_by : second_moved_by.inverse()))
      after.push_back(std::move(agreeing));
    between.insert(between.end(), links.begin(), links.end());
  }
  for (const Link* other : between)
    before.push_back(other->agreeing);
  if (numPoints(between, after, is_second) <= numPoints(between, before, is_second))
    return false;
  for (std::size_t k = 0; k < between.size(); ++k)
    between[k]->agreeing = std::move(after[k]);
  const std::size_t second_size = std::size_t(std::count(is_second.begin(), is_second.end(), 1));
  const bool move_second = 2 * second_size <= frames_.size();
  const Pose motion = move_second ? second_moved_by : second_moved_by.inverse();
  for (std::size_t i = 0; i < frames_.size(); ++i)
    if (bool(is_second[i]) == move_second) {
      model_.setWorldFromCamera(frames_[i], motion * model_.worldFromCamera(frames_[i]));
      moved_[i] = 1;
    }
  return true;
}

} // namespace

std::size_t
correctFalseConnections(const ImageGraph& graph, int component, const TrackOptions& options,
                        int num_threads, SparseModel& model)
{
  const std::size_t moved = Connections(graph, component, options, num_threads, model).correct();
  if (moved > 0)
    model.rebuildTracks(graph, component, options);
  return moved;
}

} // namespace bundle_icp
