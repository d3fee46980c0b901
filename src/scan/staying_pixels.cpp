// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/staying_pixels.h"

#include "refinement/spread.h"
#include "scan/camera_fixed_part.h"
#include "scan/frame_cells.h"
#include "scan/image_mark.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace bundle_icp {
namespace {

/** Fewer frames do not show what stays. */
constexpr std::size_t MIN_SAMPLES = 8;
/** A region whose area is less than this share of that of the largest one is small beside it. */
constexpr double SMALL_BESIDE = 0.1;
/** Largest difference of grey levels, of 255, that noise and compression leave in a cell. */
constexpr float SAME_GRAY = 5;
/** Smallest share of the cells that tell whether the camera stands still. */
constexpr double FEWEST_CELLS = 0.02;
/** Frames that must show the surroundings of a cell: something that turns hides them most of the
 *  time. */
constexpr std::size_t SELDOM_SEEN = 3;
/** Share of these frames that must agree on its grey level. */
constexpr double SURROUNDINGS = 0.5;
/** Share of what moves that lies no farther than the rest: mixed depth at edges lies anywhere. */
constexpr double NEARLY_ALL = 0.98;
/** Frames from which the surroundings of a camera that stands still are found. */
constexpr std::size_t STILL_SAMPLES = 64;

cv::Mat
medianGray(const std::vector<FrameCells>& samples)
{
  cv::Mat median(samples.front().gray.size(), CV_32FC1);
  std::vector<double> values(samples.size());
  for (int y = 0; y < median.rows; ++y)
    for (int x = 0; x < median.cols; ++x) {
      for (std::size_t k = 0; k < samples.size(); ++k)
        values[k] = samples[k].gray.at<float>(y, x);
      median.at<float>(y, x) = float(medianOf(values));
    }
  return median;
}

/** Cells that are measured, and those of them that stay. */
struct CellCount {
  double measured = 0, staying = 0;

  void
  add(bool is_measured, bool stays)
  {
    measured += is_measured;
    staying += stays;
  }

  double
  share() const
  {
    return staying / measured;
  }
};

/** Whether a cell is not one of a plain surface, which looks the same wherever the camera
 *  slides. */
bool
differsFromNeighbours(const cv::Mat& gray, int y, int x)
{
  for (const cv::Point step : {cv::Point(-2, 0), {2, 0}, {0, -2}, {0, 2}}) {
    const cv::Point other = cv::Point(x, y) + step;
    if (cv::Rect({}, gray.size()).contains(other) &&
        std::abs(gray.at<float>(other) - gray.at<float>(y, x)) > 2 * SAME_GRAY)
      return true;
  }
  return false;
}

} // namespace

class StayingPixelFinder {
public:
  StayingPixelFinder(const RGBDDataset& dataset, int num_threads, std::size_t num_samples)
  : dataset_(dataset), num_threads_(num_threads),
    samples_(readCells(dataset, num_threads, num_samples)), camera_(dataset.camera()),
    noise_(camera_.depth_noise)
  {
  }

  StayingPixels
  find()
  {
    StayingPixels found;
    if (samples_.size() < MIN_SAMPLES)
      return found;
    found.camera_fixed = findCameraFixedPart(samples_, camera_);
    findSurroundings(found);
    if (!found.cameraStandsStill()) {
      found.mark = findImageMark(samples_, camera_);
      return found;
    }
    found.camera_fixed.release(); // all of the surroundings is fixed to it
    samples_ = readCells(dataset_, num_threads_, STILL_SAMPLES);
    findSurroundings(found);
    findMovingShare(found);
    return found;
  }

private:
  std::vector<const FrameCells*>
  farthest(int y, int x) const;
  void
  findSurroundings(StayingPixels& found);
  float
  farthestMoving(const StayingPixels& found) const;
  void
  findMovingShare(StayingPixels& found) const;

  const RGBDDataset& dataset_;
  const int num_threads_;
  std::vector<FrameCells> samples_;
  const CameraIntrinsics& camera_;
  const DepthNoise& noise_;
};

/** What lies behind all that moves before it: the samples of the farthest depth that enough of them
 *  show. */
std::vector<const FrameCells*>
StayingPixelFinder::farthest(int y, int x) const
{
  std::vector<const FrameCells*> measured, same;
  for (const FrameCells& sample : samples_)
    if (sample.depth.at<float>(y, x) > 0)
      measured.push_back(&sample);
  const auto depth = [&](const FrameCells* sample) { return sample->depth.at<float>(y, x); };
  std::stable_sort(measured.begin(), measured.end(),
                   [&](const FrameCells* a, const FrameCells* b) { return depth(a) > depth(b); });
  for (const FrameCells* reference : measured) {
    same.clear();
    for (const FrameCells* sample : measured)
      if (isSameDepth(depth(sample), depth(reference), noise_))
        same.push_back(sample);
    if (same.size() >= SELDOM_SEEN)
      return same;
  }
  return {};
}

/** Depth and grey level of each cell, where most of the frames that show its farthest depth agree
 *  on the grey level. */
void
StayingPixelFinder::findSurroundings(StayingPixels& found)
{
  const cv::Mat raw = medianGray(samples_);
  for (FrameCells& sample : samples_)
    sample.gray /= brightness(sample.gray, raw);
  found.noise_ = noise_;
  found.depth_ = cv::Mat::zeros(raw.size(), CV_32FC1);
  found.gray_ = cv::Mat::zeros(raw.size(), CV_32FC1);
  CellCount all, textured;
  for (int y = 0; y < raw.rows; ++y)
    for (int x = 0; x < raw.cols; ++x) {
      const std::vector<const FrameCells*> behind = farthest(y, x);
      std::vector<double> depths, grays;
      for (const FrameCells* sample : behind) {
        depths.push_back(sample->depth.at<float>(y, x));
        grays.push_back(sample->gray.at<float>(y, x));
      }
      if (behind.empty()) // a hole of the sensor: its grey level alone is known
        for (const FrameCells& sample : samples_)
          grays.push_back(sample.gray.at<float>(y, x));
      const double gray = medianOf(grays);
      const auto same = double(std::count_if(grays.begin(), grays.end(), [gray](double value) {
        return std::abs(value - gray) < SAME_GRAY;
      }));
      const auto seen =
          double(std::count_if(samples_.begin(), samples_.end(), [&](const FrameCells& sample) {
            return sample.depth.at<float>(y, x) > 0;
          }));
      const bool is_measured = !behind.empty(), stays = is_measured && same >= STAYS * seen;
      all.add(is_measured, stays);
      if (differsFromNeighbours(raw, y, x))
        textured.add(is_measured, stays);
      if (same < SURROUNDINGS * double(grays.size()))
        continue;
      if (!behind.empty())
        found.depth_.at<float>(y, x) = float(medianOf(depths));
      found.gray_.at<float>(y, x) = std::max(float(gray), 1.f);
    }
  if (textured.measured >= FEWEST_CELLS * double(raw.total()))
    found.share_of_surroundings = std::min(all.share(), textured.share());
}

/** How far away things are that were seen before the surroundings. */
float
StayingPixelFinder::farthestMoving(const StayingPixels& found) const
{
  std::vector<float> depths;
  for (const FrameCells& sample : samples_) {
    const cv::Mat moves = found.movingCells(sample.depth, sample.gray);
    for (int y = 0; y < moves.rows; ++y)
      for (int x = 0; x < moves.cols; ++x) {
        const float z = sample.depth.at<float>(y, x), behind = found.depth_.at<float>(y, x);
        if (moves.at<uchar>(y, x) && z > 0 && z < behind && !isSameDepth(z, behind, noise_))
          depths.push_back(z);
      }
  }
  if (depths.empty())
    return std::numeric_limits<float>::infinity();
  const auto last = depths.begin() + std::ptrdiff_t(NEARLY_ALL * double(depths.size() - 1));
  std::nth_element(depths.begin(), last, depths.end());
  return *last;
}

void
StayingPixelFinder::findMovingShare(StayingPixels& found) const
{
  found.farthest_ = farthestMoving(found);
  for (const FrameCells& sample : samples_) {
    const double share = double(cv::countNonZero(found.movingCells(sample.depth, sample.gray))) /
                         double(sample.depth.total());
    found.moving_share += share / double(samples_.size());
    found.moving_frames += double(share > 0) / double(samples_.size());
  }
}

/** Cells before the surroundings, in regions that are no chance. */
cv::Mat
StayingPixels::movingCells(const cv::Mat& depth, const cv::Mat& gray) const
{
  const float gain = brightness(gray, gray_);
  cv::Mat moves(depth.size(), CV_8UC1, cv::Scalar(0)), labels, statistics, centers;
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      const float behind = depth_.at<float>(y, x), z = depth.at<float>(y, x);
      const bool is_known = gray_.at<float>(y, x) > 0;
      const bool is_same =
          is_known && std::abs(gray.at<float>(y, x) / gain - gray_.at<float>(y, x)) < SAME_GRAY &&
          (!(z > 0) || !(behind > 0) || isSameDepth(z, behind, noise_));
      const bool is_beyond = z > farthest_ && !isSameDepth(z, farthest_, noise_);
      moves.at<uchar>(y, x) = is_same || is_beyond ? 0 : 255;
    }
  // Single cells are chance, and what is small beside the largest region: edges in a blurred frame.
  // What moves and looks like what it hides leaves holes.
  cv::morphologyEx(moves, moves, cv::MORPH_OPEN, square(3));
  cv::morphologyEx(moves, moves, cv::MORPH_CLOSE, square(3));
  const int count = cv::connectedComponentsWithStats(moves, labels, statistics, centers, 8);
  double least = SMALLEST_REGION * double(moves.total());
  for (int label = 1; label < count; ++label)
    least = std::max(least, SMALL_BESIDE * statistics.at<int>(label, cv::CC_STAT_AREA));
  for (int label = 1; label < count; ++label)
    if (statistics.at<int>(label, cv::CC_STAT_AREA) < least)
      moves.setTo(0, labels == label);
  return moves;
}

cv::Mat
StayingPixels::staysWithCamera() const
{
  return mark.empty() ? camera_fixed : camera_fixed.empty() ? mark : cv::Mat(camera_fixed | mark);
}

cv::Mat
StayingPixels::movingIn(const RGBDFrame& frame) const
{
  const FrameCells sample = inCells(frame);
  cv::Mat cells, mask;
  cv::dilate(movingCells(sample.depth, sample.gray), cells, square(3));
  cv::resize(cells, mask, frame.depth.size(), 0, 0, cv::INTER_NEAREST);
  return mask;
}

cv::Mat
StayingPixels::surroundingsIn(const RGBDFrame& frame) const
{
  const FrameCells sample = inCells(frame);
  cv::Mat cells, mask;
  cv::dilate(~movingCells(sample.depth, sample.gray), cells, square(3));
  cv::resize(cells, mask, frame.depth.size(), 0, 0, cv::INTER_NEAREST);
  return mask;
}

StayingPixels
findStayingPixels(const RGBDDataset& dataset, int num_threads, std::size_t num_samples)
{
  return StayingPixelFinder(dataset, num_threads, num_samples).find();
}

} // namespace bundle_icp
