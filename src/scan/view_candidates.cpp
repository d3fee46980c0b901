// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/view_candidates.h"

#include "common/parallel.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace bundle_icp {
namespace {

constexpr int COLUMNS = 40, ROWS = 30;   ///< rays of a view
constexpr double CLEARANCE = 0.1;        ///< free space around a camera [m]
constexpr double MAX_TURN = 0.6;         ///< angle at which features are still matched [rad]
constexpr double MAX_SCALE = 2;          ///< change of distance, likewise
constexpr double MAX_DIFFERENCE = 2;     ///< of a view from the nearest frame, see difference()
constexpr std::size_t NEAREST = 8;       ///< frames that a view is compared with
constexpr std::size_t MAX_PLACES = 3000; ///< for a camera
constexpr std::size_t DIRECTIONS = 600;  ///< in which rays are cast from each
constexpr std::size_t AXES = 100;        ///< in which a camera there may look
constexpr std::size_t BATCH = 64;        ///< views that are looked at in detail at a time
constexpr std::size_t MAX_BATCHES = 40;

/** Directions that are spread evenly over the sphere. */
std::vector<Eigen::Vector3d>
spreadDirections(std::size_t count)
{
  const double golden_angle = M_PI * (3 - std::sqrt(5.0));
  std::vector<Eigen::Vector3d> directions;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * double(i) + 1) / double(count), r = std::sqrt(1 - z * z);
    const double angle = golden_angle * double(i);
    directions.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  return directions;
}

bool
hasRoom(const SeenSpace& space, const Eigen::Vector3d& place)
{
  if (space.at(place) != Seen::FREE)
    return false;
  for (int axis = 0; axis < 3; ++axis)
    for (const double offset : {-CLEARANCE, CLEARANCE})
      if (space.at(place + offset * Eigen::Vector3d::Unit(axis)) != Seen::FREE)
        return false;
  return true;
}

/** How much the pose of a frame differs from that of a camera: 1 = by the median depth, or by the
 *  turn at which features are still matched. */
double
difference(const SeenScan& scan, const SeenFrame& frame, const Eigen::Vector3d& place,
           const Eigen::Vector3d& axis)
{
  const Pose& pose = frame.world_from_camera;
  const double turn = std::acos(std::clamp(pose.linear().col(2).dot(axis), -1.0, 1.0));
  return (pose.translation() - place).norm() / scan.depths[1] + turn / MAX_TURN;
}

bool
isNearFrame(const SeenScan& scan, const Eigen::Vector3d& place, const Eigen::Vector3d& axis)
{
  return std::any_of(scan.frames.begin(), scan.frames.end(), [&](const SeenFrame& frame) {
    return difference(scan, frame, place, axis) < MAX_DIFFERENCE;
  });
}

/** Places in SeenScan::frames of those whose poses are most like that of a camera, the best
 *  first. */
std::vector<std::size_t>
nearestFrames(const SeenScan& scan, const Eigen::Vector3d& place, const Eigen::Vector3d& axis)
{
  std::vector<std::pair<double, std::size_t>> frames;
  for (std::size_t i = 0; i < scan.frames.size(); ++i)
    frames.emplace_back(difference(scan, scan.frames[i], place, axis), i);
  const std::size_t count = std::min(NEAREST, frames.size());
  std::partial_sort(frames.begin(), frames.begin() + std::ptrdiff_t(count), frames.end());
  std::vector<std::size_t> nearest;
  for (std::size_t k = 0; k < count; ++k)
    nearest.push_back(frames[k].second);
  return nearest;
}

/** A pose that looks along an axis, turned about it as a frame is. */
Pose
uprightPose(const Eigen::Vector3d& place, const Eigen::Vector3d& axis, const Pose& like)
{
  Pose pose = Pose::Identity();
  pose.translation() = place;
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(like.linear().col(2), axis);
  const Eigen::Vector3d down = turn * like.linear().col(1);
  pose.linear() << down.cross(axis), down, axis;
  return pose;
}

/** Whether a frame shows a point that a camera at `place` shows, so that features of both would be
 *  matched. */
bool
shows(const SeenScan& scan, const SeenFrame& frame, const Eigen::Vector3d& point,
      const Eigen::Vector3d& place)
{
  const Eigen::Vector3d in_camera = frame.world_from_camera.inverse() * point;
  if (!(in_camera.z() > 0))
    return false;
  const Eigen::Vector2d pixel = scan.depth_camera.project(in_camera);
  if (!scan.depth_camera.contains(pixel))
    return false;
  const double z = frame.depth.at<float>(int(std::lround(pixel.y())), int(std::lround(pixel.x())));
  const double tolerance =
      2 * scan.space.cellSize() + 2 * scan.camera.depth_noise.sigma(in_camera.z());
  if (!(std::abs(z - in_camera.z()) < tolerance)) // none is measured: NaN
    return false;
  const Eigen::Vector3d here = place - point, there = frame.world_from_camera.translation() - point;
  const double scale = here.norm() / there.norm();
  return scale < MAX_SCALE && scale > 1 / MAX_SCALE &&
         here.dot(there) > std::cos(MAX_TURN) * here.norm() * there.norm();
}

/** Calls visit(direction in the world, depth per distance) for the rays of a view. */
template <typename Visit>
void
forEachRay(const CameraIntrinsics& camera, const Pose& world_from_camera, const Visit& visit)
{
  for (int row = 0; row < ROWS; ++row)
    for (int column = 0; column < COLUMNS; ++column) {
      const Eigen::Vector3d ray = camera.unproject((column + 0.5) * camera.width / COLUMNS - 0.5,
                                                   (row + 0.5) * camera.height / ROWS - 0.5, 1);
      visit(Eigen::Vector3d(world_from_camera.linear() * ray.normalized()), 1 / ray.norm());
    }
}

/** Fills in what a view of a place would show, if it could be registered. */
SeenView
look(const SeenScan& scan, const Eigen::Vector3d& place, const Eigen::Vector3d& axis)
{
  const std::vector<std::size_t> nearest = nearestFrames(scan, place, axis);
  SeenView view;
  view.world_from_camera = uprightPose(place, axis, scan.frames[nearest.front()].world_from_camera);
  const double pixels = double(scan.camera.width) * scan.camera.height / (COLUMNS * ROWS);
  const double area_at_1m = pixels / (scan.camera.fx * scan.camera.fy);
  std::vector<std::size_t> shown(nearest.size(), 0);
  forEachRay(scan.camera, view.world_from_camera, [&](const Eigen::Vector3d& ray, double slope) {
    const RayEnd end = castRay(scan, place, ray);
    const double z = end.distance * slope;
    if (end.met == Met::NOTHING || z < scan.depths[0])
      return;
    if (end.met == Met::GAP)
      view.missing.emplace_back(std::uint32_t(end.cell), float(area_at_1m * z * z));
    else
      for (std::size_t k = 0; k < nearest.size(); ++k)
        shown[k] += shows(scan, scan.frames[nearest[k]], place + end.distance * ray, place);
  });
  const auto most = std::max_element(shown.begin(), shown.end());
  view.frame = nearest[std::size_t(most - shown.begin())];
  view.shared = double(*most) / (COLUMNS * ROWS);
  return view;
}

/** Places in free space within a median depth of a frame, on a grid that has not too many. */
std::vector<Eigen::Vector3d>
findPlaces(const SeenScan& scan)
{
  std::vector<Eigen::Vector3d> places;
  const auto isNear = [&](const Eigen::Vector3d& place) {
    return std::any_of(scan.frames.begin(), scan.frames.end(), [&](const SeenFrame& frame) {
      return (frame.world_from_camera.translation() - place).norm() < scan.depths[1];
    });
  };
  for (double spacing = scan.depths[1] / 10;; spacing *= 1.25) {
    places.clear();
    scan.space.forEachFree(spacing, [&](const Eigen::Vector3d& place) {
      if (isNear(place) && hasRoom(scan.space, place))
        places.push_back(place);
    });
    if (places.size() <= MAX_PLACES)
      return places;
  }
}

} // namespace

double
SeenView::area(const std::vector<std::uint8_t>& covered) const
{
  double sum = 0;
  for (const auto& [cell, area] : missing)
    sum += covered[cell] ? 0 : area;
  return sum;
}

RayEnd
castRay(const SeenScan& scan, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)
{
  // What is unseen may hide what lies behind: one looks through little of it.
  const double max_unseen = scan.depths[1] / 2;
  double unseen = 0;
  RayEnd end;
  scan.space.walk(origin, direction, scan.depths[2], [&](std::size_t cell, double distance) {
    const Seen seen = scan.space[cell];
    if (seen == Seen::SURFACE || scan.gaps[cell]) {
      end = {scan.gaps[cell] ? Met::GAP : Met::SURFACE, cell, distance};
      return false;
    }
    unseen += seen == Seen::NOTHING ? scan.space.cellSize() : 0;
    return unseen < max_unseen;
  });
  return end;
}

ViewSearch::ViewSearch(const SeenScan& scan, const NextViewOptions& options)
: scan_(scan), options_(options), axes_(spreadDirections(AXES))
{
  const std::vector<Eigen::Vector3d> centers = findPlaces(scan),
                                     directions = spreadDirections(DIRECTIONS);
  constexpr double solid_angle = 4 * M_PI / DIRECTIONS;
  places_.resize(centers.size());
  parallelFor(centers.size(), options.num_threads, {}, [&](std::size_t i) {
    Place& place = places_[i];
    place.center = centers[i];
    place.by_axis.resize(AXES);
    for (const Eigen::Vector3d& direction : directions)
      if (const RayEnd end = castRay(scan, place.center, direction);
          end.met == Met::GAP && end.distance > scan.depths[0]) {
        place.directions.push_back(direction);
        place.missing.emplace_back(std::uint32_t(end.cell),
                                   float(solid_angle * end.distance * end.distance));
      }
  });
}

std::vector<ViewSearch::Candidate>
ViewSearch::roughCandidates(const std::vector<std::uint8_t>& covered) const
{
  // The cone that is as wide as the image on average.
  const double tangent =
      std::sqrt(scan_.camera.width / scan_.camera.fx * scan_.camera.height / scan_.camera.fy) / 2;
  const double inside = 1 / std::hypot(1, tangent);
  std::vector<std::vector<Candidate>> of_place(places_.size());
  parallelFor(places_.size(), options_.num_threads, {}, [&](std::size_t i) {
    const Place& place = places_[i];
    for (std::size_t axis = 0; axis < AXES; ++axis) {
      if (place.by_axis[axis] && !*place.by_axis[axis])
        continue;
      Candidate candidate{0, i, axis, Eigen::Vector3d::Zero()};
      for (std::size_t k = 0; k < place.missing.size(); ++k)
        if (const auto& [cell, area] = place.missing[k];
            !covered[cell] && place.directions[k].dot(axes_[axis]) > inside) {
          candidate.area += area;
          candidate.target += area * place.directions[k];
        }
      candidate.target.normalize();
      if (candidate.area >= options_.min_area / 2)
        of_place[i].push_back(candidate);
    }
  });
  std::vector<Candidate> candidates;
  for (const std::vector<Candidate>& some : of_place)
    candidates.insert(candidates.end(), some.begin(), some.end());
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.area > b.area; });
  return candidates;
}

std::optional<SeenView>
ViewSearch::best(const std::vector<std::uint8_t>& covered)
{
  const std::vector<Candidate> candidates = roughCandidates(covered);
  std::optional<SeenView> best;
  double most = 0;
  std::size_t useful = 0;
  for (std::size_t begin = 0;
       begin < std::min(candidates.size(), MAX_BATCHES * BATCH) && useful < BATCH; begin += BATCH) {
    const std::size_t count = std::min(BATCH, candidates.size() - begin);
    parallelFor(count, options_.num_threads, {}, [&](std::size_t k) {
      const Candidate& candidate = candidates[begin + k];
      Place& place = places_[candidate.place];
      auto& seen = place.by_axis[candidate.axis];
      if (seen)
        return;
      seen.emplace();
      if (!isNearFrame(scan_, place.center, candidate.target))
        return;
      SeenView view = look(scan_, place.center, candidate.target);
      if (view.shared >= options_.min_shared)
        *seen = std::move(view);
    });
    for (std::size_t k = 0; k < count; ++k)
      if (const auto& view =
              *places_[candidates[begin + k].place].by_axis[candidates[begin + k].axis]) {
        const double area = view->area(covered);
        useful += area >= options_.min_area;
        if (area >= options_.min_area && area * view->shared > most) {
          most = area * view->shared;
          best = view;
        }
      }
  }
  return best;
}

void
cover(const SeenScan& scan, const SeenView& view, std::vector<std::uint8_t>& covered)
{
  const Eigen::Vector3d place = view.world_from_camera.translation();
  const Pose camera_from_world = view.world_from_camera.inverse();
  for (const auto& missing : view.missing) {
    const Eigen::Vector3d center = scan.space.center(missing.first);
    for (int i = 0; i < 27; ++i) // also beside the ray
      if (const auto cell =
              scan.space.find(center + scan.space.cellSize() *
                                           Eigen::Vector3d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)))
        covered[*cell] = true;
  }
  for (std::size_t cell = 0; cell < covered.size(); ++cell) {
    if (!scan.gaps[cell] || covered[cell])
      continue;
    const Eigen::Vector3d center = scan.space.center(cell), point = camera_from_world * center;
    if (point.z() < scan.depths[0] || point.z() > scan.depths[2] ||
        !scan.camera.contains(scan.camera.project(point)))
      continue;
    bool is_seen = true;
    scan.space.walk(place, (center - place).normalized(), (center - place).norm(),
                    [&](std::size_t passed, double) {
                      is_seen = scan.space[passed] != Seen::SURFACE;
                      return is_seen;
                    });
    covered[cell] = is_seen;
  }
}

} // namespace bundle_icp
