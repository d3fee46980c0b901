// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/moving_pixels.h"

#include "common/by_time.h"
#include "common/parallel.h"
#include "refinement/pose_evidence.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <limits>
#include <set>

namespace bundle_icp {
namespace {

/** Frames that a frame is compared with. */
constexpr std::size_t MAX_OTHERS = 24;
/** Depth so far in front of what another frame saw lies in free space, whatever the images' own
 *  errors [sigma]. */
constexpr double CLEARLY_IN_FRONT = 2 * AGREEING_SIGMAS;
/** So many frames must have looked through: a single one may be wrong itself. */
constexpr int MIN_VOTES = 2;
/** Pixels of a view, in each direction, that an edge may be displaced to. */
constexpr int AROUND = 7;
/** Pixels that are looked at, in each direction of the view. */
constexpr int STEP = 2;
/** Smallest share of the image that is no chance, and largest that is no wrong pose. */
constexpr double MIN_SHARE = 0.005, MAX_SHARE = 0.5;

class MovingPixelFinder {
public:
  MovingPixelFinder(const ImageGraph& graph, const SparseModel& model,
                    const std::vector<VerifiedFrame>& frames,
                    const std::function<std::shared_ptr<const DepthView>(std::size_t)>& depth_views)
  : graph_(graph), model_(model), frames_(frames), depth_views_(depth_views)
  {
  }

  MovingPixels
  find(std::size_t frame) const;

private:
  bool
  canVote(std::size_t other, std::size_t frame) const
  {
    return other != frame && frames_[other].verdict == FrameVerdict::GOOD &&
           model_.component(other) == model_.component(frame);
  }
  std::vector<std::size_t>
  others(std::size_t frame) const;
  cv::Mat
  vote(std::size_t frame, const DepthView& view) const;

  const ImageGraph& graph_;
  const SparseModel& model_;
  const std::vector<VerifiedFrame>& frames_;
  const std::function<std::shared_ptr<const DepthView>(std::size_t)>& depth_views_;
};

/** Evenly from those with most matches to those with fewest: what moves has hardly moved in the
 *  nearest ones. A frame with few, because something hides the scene, is compared with those that
 *  look from about the same place as well. */
std::vector<std::size_t>
MovingPixelFinder::others(std::size_t frame) const
{
  std::vector<std::pair<double, std::size_t>> matched, near;
  for (const ImageEdge& edge : graph_.edges(frame))
    if (canVote(edge.neighbour, frame))
      matched.emplace_back(-double(edge.pair->matches.size()), edge.neighbour);
  std::sort(matched.begin(), matched.end());
  const std::size_t count = std::min(matched.size(), MAX_OTHERS);
  std::set<std::size_t> result;
  for (std::size_t k = 0; k < count; ++k)
    result.insert(matched[k * matched.size() / count].second);
  for (std::size_t other = 0; count < MAX_OTHERS && other < frames_.size(); ++other)
    if (canVote(other, frame)) {
      const Pose motion = model_.worldFromDepth(frame).inverse() * model_.worldFromDepth(other);
      near.emplace_back(motion.translation().norm() + rotationAngle(motion), other);
    }
  std::sort(near.begin(), near.end());
  for (std::size_t k = 0; k < near.size() && result.size() < MAX_OTHERS; ++k)
    result.insert(near[k].second);
  return {result.begin(), result.end()};
}

/** Smallest depth around each pixel: an image that moves while it is taken has edges elsewhere. */
cv::Mat
nearestAround(const DepthView& view)
{
  cv::Mat nearest = view.depth.clone();
  nearest.setTo(std::numeric_limits<float>::max(), ~(view.depth > 0));
  cv::erode(nearest, nearest, cv::getStructuringElement(cv::MORPH_RECT, {AROUND, AROUND}));
  return nearest;
}

/** 255 where most of the frames that looked at a point saw free space. */
cv::Mat
MovingPixelFinder::vote(std::size_t frame, const DepthView& view) const
{
  const cv::Size size(view.camera.width / STEP, view.camera.height / STEP);
  cv::Mat votes(size, CV_16SC2, cv::Scalar::all(0)); // looked through, agree
  for (const std::size_t other : others(frame)) {
    const auto other_view = depth_views_(other);
    const DepthComparison comparison(
        view, *other_view, model_.worldFromDepth(other).inverse() * model_.worldFromDepth(frame));
    const cv::Mat nearest = nearestAround(*other_view);
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        const auto place = comparison.place(y * STEP, x * STEP);
        const auto sigmas = place ? comparison.sigmasInFront(*place) : std::nullopt;
        if (!sigmas)
          continue;
        const double free_up_to =
            nearest.at<float>(place->row, place->column) - CLEARLY_IN_FRONT * place->sigma;
        cv::Vec2s& vote = votes.at<cv::Vec2s>(y, x);
        vote[0] = short(vote[0] + (place->point.z() < free_up_to));
        vote[1] = short(vote[1] + (std::abs(*sigmas) < AGREEING_SIGMAS));
      }
  }
  cv::Mat moves(size, CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      if (const cv::Vec2s& vote = votes.at<cv::Vec2s>(y, x);
          vote[0] >= MIN_VOTES && vote[0] > vote[1])
        moves.at<uchar>(y, x) = 255;
  return moves;
}

MovingPixels
MovingPixelFinder::find(std::size_t frame) const
{
  const std::shared_ptr<const DepthView> view = depth_views_(frame);
  const cv::Mat votes = vote(frame, *view);
  // Holes between votes are closed, thin strips are errors of edges.
  cv::Mat moves, labels, statistics, centers;
  const auto square = [](int side) {
    return cv::getStructuringElement(cv::MORPH_RECT, {side, side});
  };
  cv::morphologyEx(votes, moves, cv::MORPH_CLOSE, square(3));
  cv::morphologyEx(moves, moves, cv::MORPH_OPEN, square(3));
  const int count = cv::connectedComponentsWithStats(moves, labels, statistics, centers, 8);
  cv::Mat kept(moves.size(), CV_8UC1, cv::Scalar(0));
  for (int label = 1; label < count; ++label)
    if (statistics.at<int>(label, cv::CC_STAT_AREA) >= MIN_SHARE * double(moves.total()))
      kept |= labels == label;
  MovingPixels result;
  if (cv::countNonZero(kept) == 0)
    return result;
  cv::dilate(kept, kept, square(5)); // what moves ends where depth is mixed, and has no vote
  cv::resize(kept, result.mask, view->depth.size(), 0, 0, cv::INTER_NEAREST);
  const cv::Mat measured = view->depth > 0;
  result.share =
      double(cv::countNonZero(result.mask & measured)) / std::max(1, cv::countNonZero(measured));
  return result.share <= MAX_SHARE ? result : MovingPixels();
}

} // namespace

std::vector<MovingPixels>
findMovingPixels(const ImageGraph& graph, const SparseModel& model,
                 const std::vector<VerifiedFrame>& frames,
                 const std::function<std::shared_ptr<const DepthView>(std::size_t)>& depth_views,
                 int num_threads)
{
  std::vector<MovingPixels> result(frames.size());
  const MovingPixelFinder finder(graph, model, frames, depth_views);
  // In the order of time neighbours share the views that they are compared with.
  std::vector<std::size_t> good;
  for (std::size_t frame = 0; frame < frames.size(); ++frame)
    if (frames[frame].verdict == FrameVerdict::GOOD)
      good.push_back(frame);
  good = byTime(graph, std::move(good));
  parallelFor(good.size(), num_threads, {},
              [&](std::size_t k) { result[good[k]] = finder.find(good[k]); });
  return result;
}

} // namespace bundle_icp
