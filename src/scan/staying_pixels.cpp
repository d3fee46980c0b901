// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/staying_pixels.h"

#include "common/parallel.h"
#include "refinement/spread.h"

#include <opencv2/imgproc.hpp>
#include <pcl/exceptions.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace bundle_icp {
namespace {

/** Frames are looked at in cells of so many pixels. */
constexpr int CELL = 4;
/** Fewer frames do not show what stays. */
constexpr std::size_t MIN_SAMPLES = 8;
/** A cell stays when its depth is the same in this share of the frames. */
constexpr double STAYS = 0.85;
/** Beside cells that stay, those count as well that are measured in fewer frames, but at least in
 *  this share: the sensor sees little of steep sides. */
constexpr double SELDOM_MEASURED = 0.25;
/** Depth is the same within so many standard deviations of the sensor. */
constexpr double SAME_SIGMAS = 4;
/** Smallest share of the image that counts. */
constexpr double MIN_SHARE = 0.005;
/** A region whose area is less than this share of that of the largest one is small beside it. */
constexpr double SMALL_BESIDE = 0.1;
/** Share of a region's border at which depth must break off. */
constexpr double MIN_EDGE = 0.6;

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

/** A frame in cells. */
struct Sample {
  cv::Mat depth; ///< of every CELL-th pixel [m]
  cv::Mat gray;  ///< CV_32FC1, mean of the cell
};

Sample
inCells(const RGBDFrame& frame)
{
  const cv::Size size(frame.depth.cols / CELL, frame.depth.rows / CELL);
  Sample sample;
  cv::Mat color;
  cv::resize(frame.depth, sample.depth, size, 0, 0, cv::INTER_NEAREST);
  cv::resize(frame.color, color, size, 0, 0, cv::INTER_AREA);
  cv::cvtColor(color, sample.gray, cv::COLOR_BGR2GRAY);
  sample.gray.convertTo(sample.gray, CV_32F);
  return sample;
}

/** Frames that can be read. */
std::vector<Sample>
readSamples(const RGBDDataset& dataset, int num_threads, std::size_t num_samples)
{
  const std::size_t count = std::min(num_samples, dataset.size());
  std::vector<Sample> samples(count);
  parallelFor(count, num_threads, {}, [&](std::size_t k) {
    try {
      samples[k] = inCells(dataset.read(k * dataset.size() / count));
    }
    catch (const pcl::IOException&) { // the frame's own report says so
    }
  });
  samples.erase(std::remove_if(samples.begin(), samples.end(),
                               [](const Sample& sample) { return sample.depth.empty(); }),
                samples.end());
  return samples;
}

bool
isSame(float a, float b, const DepthNoise& noise)
{
  return std::abs(a - b) <= SAME_SIGMAS * std::sqrt(2.0) * noise.sigma(std::max(a, b));
}

/** Median depth of each cell that stays at it in most of the frames that measure it, 0 elsewhere.
 *  \param measured share of all frames that must measure it there */
cv::Mat
constantDepth(const std::vector<Sample>& samples, const DepthNoise& noise, double measured)
{
  cv::Mat constant(samples.front().depth.size(), CV_32FC1, cv::Scalar(0));
  std::vector<float> values;
  for (int y = 0; y < constant.rows; ++y)
    for (int x = 0; x < constant.cols; ++x) {
      values.clear();
      for (const Sample& sample : samples)
        if (sample.depth.at<float>(y, x) > 0)
          values.push_back(sample.depth.at<float>(y, x));
      const double needed =
          std::max(STAYS * double(values.size()), measured * double(samples.size()));
      if (double(values.size()) < needed)
        continue;
      const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
      std::nth_element(values.begin(), middle, values.end());
      const float median = *middle;
      const auto same = std::count_if(values.begin(), values.end(),
                                      [&](float z) { return isSame(z, median, noise); });
      if (double(same) >= needed)
        constant.at<float>(y, x) = median;
    }
  return constant;
}

/** Share of the border of region `label`, within the image, beyond which depth is elsewhere in most
 *  frames. Two cells out: the cell at an edge mixes both sides. */
double
edgeShare(const cv::Mat& labels, int label, const cv::Mat& constant,
          const std::vector<Sample>& samples, const DepthNoise& noise)
{
  std::size_t border = 0, edges = 0;
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < labels.cols; ++x) {
      if (labels.at<int>(y, x) != label)
        continue;
      for (const cv::Point step : {cv::Point(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
        const cv::Point next = cv::Point(x, y) + step, beyond = next + step;
        if (!cv::Rect({}, labels.size()).contains(beyond) || labels.at<int>(next) == label)
          continue;
        std::size_t apart = 0, measured = 0;
        for (const Sample& sample : samples)
          if (const float z = sample.depth.at<float>(beyond); z > 0) {
            ++measured;
            apart += !isSame(z, constant.at<float>(y, x), noise) &&
                     std::abs(z - constant.at<float>(y, x)) > 0.05 * constant.at<float>(y, x);
          }
        ++border;
        edges += 2 * apart > measured;
      }
    }
  return border ? double(edges) / double(border) : 0;
}

/** Grows a mask into all of `allowed` that is connected with it. */
void
growInto(cv::Mat& mask, const cv::Mat& allowed)
{
  for (int before = 0, now = cv::countNonZero(mask); now > before;) {
    before = now;
    cv::Mat grown;
    cv::dilate(mask, grown, cv::Mat());
    mask |= grown & allowed;
    now = cv::countNonZero(mask);
  }
}

/** Brightness of a frame as a multiple of that of `reference`, where both are known. */
float
gainOf(const cv::Mat& gray, const cv::Mat& reference)
{
  std::vector<double> ratios;
  for (int y = 0; y < gray.rows; ++y)
    for (int x = 0; x < gray.cols; ++x)
      if (reference.at<float>(y, x) > 0)
        ratios.push_back(gray.at<float>(y, x) / reference.at<float>(y, x));
  const double gain = medianOf(std::move(ratios));
  return gain > 0 ? float(gain) : 1;
}

cv::Mat
medianGray(const std::vector<Sample>& samples)
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

cv::Mat
square(int side)
{
  return cv::getStructuringElement(cv::MORPH_RECT, {side, side});
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
    samples_(readSamples(dataset, num_threads, num_samples)), camera_(dataset.camera()),
    noise_(camera_.depth_noise)
  {
  }

  StayingPixels
  find()
  {
    StayingPixels found;
    if (samples_.size() < MIN_SAMPLES)
      return found;
    findCameraFixed(found);
    findSurroundings(found);
    if (!found.cameraStandsStill())
      return found;
    found.camera_fixed.release(); // all of the surroundings is fixed to it
    samples_ = readSamples(dataset_, num_threads_, STILL_SAMPLES);
    findSurroundings(found);
    findMovingShare(found);
    return found;
  }

private:
  void
  findCameraFixed(StayingPixels& found) const;
  std::vector<const Sample*>
  farthest(int y, int x) const;
  void
  findSurroundings(StayingPixels& found);
  float
  farthestMoving(const StayingPixels& found) const;
  void
  findMovingShare(StayingPixels& found) const;

  const RGBDDataset& dataset_;
  const int num_threads_;
  std::vector<Sample> samples_;
  const CameraIntrinsics& camera_;
  const DepthNoise& noise_;
};

void
StayingPixelFinder::findCameraFixed(StayingPixels& found) const
{
  const cv::Mat constant = constantDepth(samples_, noise_, STAYS);
  cv::Mat measured(constant.size(), CV_8UC1, cv::Scalar(0));
  for (const Sample& sample : samples_)
    measured |= sample.depth > 0;
  cv::Mat stays = constant > 0;
  found.share = double(cv::countNonZero(stays)) / std::max(1, cv::countNonZero(measured));
  if (found.share == 0 || found.share > 0.5)
    return;
  // Holes of the sensor are closed, single cells are chance.
  cv::morphologyEx(stays, stays, cv::MORPH_CLOSE, square(5));
  cv::morphologyEx(stays, stays, cv::MORPH_OPEN, square(3));
  cv::Mat labels, statistics, centers;
  const int count = cv::connectedComponentsWithStats(stays, labels, statistics, centers, 4);
  cv::Mat mask(stays.size(), CV_8UC1, cv::Scalar(0));
  for (int label = 1; label < count; ++label)
    if (statistics.at<int>(label, cv::CC_STAT_AREA) >= MIN_SHARE * double(mask.total()) &&
        edgeShare(labels, label, constant, samples_, noise_) >= MIN_EDGE)
      mask |= labels == label;
  if (cv::countNonZero(mask) == 0)
    return;
  growInto(mask, constantDepth(samples_, noise_, SELDOM_MEASURED) > 0);
  cv::dilate(mask, mask, square(5)); // mixed pixels at its edge
  cv::resize(mask, found.camera_fixed, {camera_.width, camera_.height}, 0, 0, cv::INTER_NEAREST);
}

/** What lies behind all that moves before it: the samples of the farthest depth that enough of them
 *  show. */
std::vector<const Sample*>
StayingPixelFinder::farthest(int y, int x) const
{
  std::vector<const Sample*> measured, same;
  for (const Sample& sample : samples_)
    if (sample.depth.at<float>(y, x) > 0)
      measured.push_back(&sample);
  const auto depth = [&](const Sample* sample) { return sample->depth.at<float>(y, x); };
  std::stable_sort(measured.begin(), measured.end(),
                   [&](const Sample* a, const Sample* b) { return depth(a) > depth(b); });
  for (const Sample* reference : measured) {
    same.clear();
    for (const Sample* sample : measured)
      if (isSame(depth(sample), depth(reference), noise_))
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
  for (Sample& sample : samples_)
    sample.gray /= gainOf(sample.gray, raw);
  found.noise_ = noise_;
  found.depth_ = cv::Mat::zeros(raw.size(), CV_32FC1);
  found.gray_ = cv::Mat::zeros(raw.size(), CV_32FC1);
  CellCount all, textured;
  for (int y = 0; y < raw.rows; ++y)
    for (int x = 0; x < raw.cols; ++x) {
      const std::vector<const Sample*> behind = farthest(y, x);
      std::vector<double> depths, grays;
      for (const Sample* sample : behind) {
        depths.push_back(sample->depth.at<float>(y, x));
        grays.push_back(sample->gray.at<float>(y, x));
      }
      if (behind.empty()) // a hole of the sensor: its grey level alone is known
        for (const Sample& sample : samples_)
          grays.push_back(sample.gray.at<float>(y, x));
      const double gray = medianOf(grays);
      const auto same = double(std::count_if(grays.begin(), grays.end(), [gray](double value) {
        return std::abs(value - gray) < SAME_GRAY;
      }));
      const auto seen =
          double(std::count_if(samples_.begin(), samples_.end(), [&](const Sample& sample) {
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
  for (const Sample& sample : samples_) {
    const cv::Mat moves = found.movingCells(sample.depth, sample.gray);
    for (int y = 0; y < moves.rows; ++y)
      for (int x = 0; x < moves.cols; ++x) {
        const float z = sample.depth.at<float>(y, x), behind = found.depth_.at<float>(y, x);
        if (moves.at<uchar>(y, x) && z > 0 && z < behind && !isSame(z, behind, noise_))
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
  for (const Sample& sample : samples_) {
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
  const float gain = gainOf(gray, gray_);
  cv::Mat moves(depth.size(), CV_8UC1, cv::Scalar(0)), labels, statistics, centers;
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      const float behind = depth_.at<float>(y, x), z = depth.at<float>(y, x);
      const bool is_known = gray_.at<float>(y, x) > 0;
      const bool is_same =
          is_known && std::abs(gray.at<float>(y, x) / gain - gray_.at<float>(y, x)) < SAME_GRAY &&
          (!(z > 0) || !(behind > 0) || isSame(z, behind, noise_));
      const bool is_beyond = z > farthest_ && !isSame(z, farthest_, noise_);
      moves.at<uchar>(y, x) = is_same || is_beyond ? 0 : 255;
    }
  // Single cells are chance, and what is small beside the largest region: edges in a blurred frame.
  // What moves and looks like what it hides leaves holes.
  cv::morphologyEx(moves, moves, cv::MORPH_OPEN, square(3));
  cv::morphologyEx(moves, moves, cv::MORPH_CLOSE, square(3));
  const int count = cv::connectedComponentsWithStats(moves, labels, statistics, centers, 8);
  double least = MIN_SHARE * double(moves.total());
  for (int label = 1; label < count; ++label)
    least = std::max(least, SMALL_BESIDE * statistics.at<int>(label, cv::CC_STAT_AREA));
  for (int label = 1; label < count; ++label)
    if (statistics.at<int>(label, cv::CC_STAT_AREA) < least)
      moves.setTo(0, labels == label);
  return moves;
}

cv::Mat
StayingPixels::movingIn(const RGBDFrame& frame) const
{
  const Sample sample = inCells(frame);
  cv::Mat cells, mask;
  cv::dilate(movingCells(sample.depth, sample.gray), cells, square(3));
  cv::resize(cells, mask, frame.depth.size(), 0, 0, cv::INTER_NEAREST);
  return mask;
}

cv::Mat
StayingPixels::surroundingsIn(const RGBDFrame& frame) const
{
  const Sample sample = inCells(frame);
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
