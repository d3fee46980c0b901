// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/depth_numbers.h"

#include "refinement/format_text.h"
#include "refinement/spread.h"
#include "scan/lone_depth.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Steps beyond this are no sensor's: those of the first Kinect reach two [sigma]. */
constexpr double LARGEST_STEP = 5;
/** Share of the depth at the largest value from which it is clipped there. */
constexpr double CLIPPED_SHARE = 0.05;
/** Share of pixels that differ from their neighbours, from which depth is noise in part, and as a
 *  whole. */
constexpr double SOME_ALONE = 0.01, MOST_ALONE = 0.1;
/** Patches of the image in which planes are looked for: their number along its width, samples along
 *  their sides, share of the samples that must be measured, and the largest ratio of
 *  depths in a patch: more is an edge. Smaller patches show errors of the sensor, larger ones are
 *  seldom flat. */
constexpr int NUM_PATCHES = 5, NUM_SAMPLES = 25;
constexpr double MEASURED = 0.9, LARGEST_RATIO = 1.6;
/** A patch is flat when it deviates by less from a plane [sigma of a pixel]. */
constexpr double FLAT = 2;
/** A patch has a slope when its depths differ by this ratio. */
constexpr double SLOPE = 1.1;
/** A mean over patches so many of its deviations below 0 is no chance. */
constexpr double SURE = 5;
/** Fewer patches say nothing. */
constexpr std::size_t FEWEST_PATCHES = 10;

struct Sample {
  double x, y, z; ///< on the image plane at distance 1, depth [m]
};

/** Samples of a patch; empty where it has holes or an edge. */
std::vector<Sample>
samplePatch(const cv::Mat& depth, const cv::Rect& patch, const CameraIntrinsics& camera)
{
  std::vector<Sample> samples;
  const int step = std::max(1, patch.width / NUM_SAMPLES);
  std::size_t total = 0;
  double least = INFINITY, largest = 0;
  for (int v = patch.y; v < patch.y + patch.height; v += step)
    for (int u = patch.x; u < patch.x + patch.width; u += step) {
      ++total;
      const double z = double(depth.at<float>(v, u));
      if (!(z > 0))
        continue;
      samples.push_back({(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, z});
      least = std::min(least, z);
      largest = std::max(largest, z);
    }
  if (double(samples.size()) < MEASURED * double(total) || largest > LARGEST_RATIO * least)
    samples.clear();
  return samples;
}

/** Linear fit in x and y, and in one more regressor if it is given. */
struct Fit {
  Eigen::VectorXd fitted;
  double rms = 0;         ///< of what is left
  double coefficient = 0; ///< of the regressor
};

Fit
fitLinear(const std::vector<Sample>& samples, const Eigen::VectorXd& values,
          const Eigen::VectorXd* regressor = nullptr)
{
  Eigen::MatrixXd columns(values.size(), regressor ? 4 : 3);
  for (Eigen::Index i = 0; i < values.size(); ++i)
    columns.row(i).head<3>() << 1, samples[std::size_t(i)].x, samples[std::size_t(i)].y;
  if (regressor)
    columns.col(3) = *regressor;
  const Eigen::VectorXd solution =
      (columns.transpose() * columns).ldlt().solve(columns.transpose() * values);
  const Eigen::VectorXd fitted = columns * solution;
  return {fitted, std::sqrt((values - fitted).squaredNorm() / double(values.size())),
          regressor ? solution[3] : 0};
}

void
addPatch(const std::vector<Sample>& samples, const DepthNoise& noise, DepthNumbers& numbers)
{
  const auto count = Eigen::Index(samples.size());
  Eigen::VectorXd depth(count), inverse(count), rays(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    depth[i] = samples[std::size_t(i)].z;
    inverse[i] = 1 / depth[i];
  }
  const Fit plane = fitLinear(samples, inverse);
  // 1 / length = 1 / depth (1 - g): what rays add to the inverse depth of the plane, which has less
  // noise than that of the pixels.
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto& [x, y, z] = samples[std::size_t(i)];
    rays[i] = -(1 - 1 / std::sqrt(1 + x * x + y * y)) * plane.fitted[i];
  }
  const double mean = depth.mean(), relative_sigma = noise.sigma(mean) / mean;
  const Fit with_rays = fitLinear(samples, inverse, &rays);
  if (with_rays.rms * mean < FLAT * relative_sigma)
    numbers.ray_shares.push_back(with_rays.coefficient);
  const double as_depth = plane.rms * mean;
  const double as_inverse = fitLinear(samples, depth).rms / mean;
  if (depth.maxCoeff() > SLOPE * depth.minCoeff() && as_depth > 0 && as_inverse > 0)
    numbers.inverse_ratios.push_back(std::log(as_inverse / as_depth));
}

void
addSteps(const cv::Mat& depth, const DepthNoise& noise, DepthNumbers& numbers)
{
  std::vector<float> values;
  for (int v = 0; v < depth.rows; v += 2)
    for (int u = 0; u < depth.cols; u += 2)
      if (depth.at<float>(v, u) > 0)
        values.push_back(depth.at<float>(v, u));
  if (values.empty())
    return;
  numbers.has_depth = true;
  std::sort(values.begin(), values.end());
  numbers.largest = double(values.back());
  std::vector<double> steps, step_sigmas;
  for (auto value = values.begin(); value != values.end();) {
    const auto next = std::upper_bound(value, values.end(), *value);
    const auto number = std::size_t(next - value);
    if (next == values.end())
      numbers.at_most = double(number) / double(values.size());
    else {
      const double step = double(*next - *value);
      steps.insert(steps.end(), number, step);
      step_sigmas.insert(step_sigmas.end(), number, step / noise.sigma(double(*value)));
    }
    value = next;
  }
  numbers.step = medianOf(steps);
  numbers.step_sigmas = medianOf(step_sigmas);
}

/** Share of the measured pixels. */
double
shareAlone(const cv::Mat& depth)
{
  return double(cv::countNonZero(loneDepth(depth))) /
         double(std::max(1, cv::countNonZero(depth > 0)));
}

/** How many of its standard deviations a mean lies above 0; 0 of few values. */
double
deviationsOfMean(const std::vector<double>& values)
{
  double sum = 0, squares = 0;
  for (const double value : values) {
    sum += value;
    squares += value * value;
  }
  const double number = double(values.size()), variance = squares * number - sum * sum;
  return values.size() >= 2 * FEWEST_PATCHES && variance > 0
             ? sum * std::sqrt(number) / std::sqrt(variance)
             : 0;
}

Finding
fault(const std::string& what, const char* name, double value, const char* remedy)
{
  return {Severity::FAULT, "depth_numbers", what, {{name, value}}, remedy};
}

} // namespace

DepthNumbers
numbersOf(const cv::Mat& depth, const CameraIntrinsics& camera)
{
  DepthNumbers numbers;
  addSteps(depth, camera.depth_noise, numbers);
  numbers.alone = shareAlone(depth);
  const int size = depth.cols / NUM_PATCHES;
  for (int y = 0; size >= NUM_SAMPLES && y + size <= depth.rows; y += size / 2)
    for (int x = 0; x + size <= depth.cols; x += size / 2)
      if (const auto samples = samplePatch(depth, {x, y, size, size}, camera); !samples.empty())
        addPatch(samples, camera.depth_noise, numbers);
  return numbers;
}

void
checkNumbers(const std::vector<DepthNumbers>& frames, double share_of_views,
             std::vector<Finding>& findings)
{
  std::vector<double> steps, step_sigmas, largest, at_most, alone, ray_shares, inverse_ratios;
  for (const DepthNumbers& frame : frames) {
    if (!frame.has_depth)
      continue;
    steps.push_back(frame.step);
    step_sigmas.push_back(frame.step_sigmas);
    largest.push_back(frame.largest);
    at_most.push_back(frame.at_most);
    alone.push_back(frame.alone);
    ray_shares.insert(ray_shares.end(), frame.ray_shares.begin(), frame.ray_shares.end());
    inverse_ratios.insert(inverse_ratios.end(), frame.inverse_ratios.begin(),
                          frame.inverse_ratios.end());
  }
  if (steps.empty())
    return;
  if (medianOf(step_sigmas) > LARGEST_STEP)
    findings.push_back(
        fault(formatText("depth comes in steps of %.3g m, far more than the sensor's noise: it was "
                         "rounded, or stretched for display",
                         medianOf(steps)),
              "step_m", medianOf(steps), "record depth as the sensor gives it, in 16 bits"));
  // The depth of a wall is the largest in one frame, but not in all.
  const bool is_one_number = std::count(largest.begin(), largest.end(), medianOf(largest)) >=
                             std::ptrdiff_t(largest.size() / 2);
  if (const double share = medianOf(at_most); is_one_number && share > CLIPPED_SHARE)
    findings.push_back(
        fault(formatText("in a typical frame %.0f %% of the depth has one and the same depth, the "
                         "largest: it was clipped",
                         100 * share),
              "clipped_share", share, "record depth unclipped, or set what is too far to 0"));
  if (const double share = medianOf(alone); share > SOME_ALONE)
    findings.push_back(
        {share > MOST_ALONE ? Severity::FAULT : Severity::WARNING,
         "depth_numbers",
         formatText("%.0f %% of the depth is noise: it differs from all of its neighbours, "
                    "and is left out",
                    100 * share),
         {{"share", share}},
         "if the bytes of the files are swapped, or they hold no depth, convert them"});
  const double inverse = -deviationsOfMean(inverse_ratios) * std::sqrt(share_of_views);
  if (inverse > SURE)
    findings.push_back(fault("planes are flat only if the numbers are inverse depth (disparity), "
                             "not depth",
                             "deviations", inverse,
                             "convert disparity to depth: focal length x baseline / disparity"));
  else if (const Spread spread = spreadOf(ray_shares);
           ray_shares.size() >= FEWEST_PATCHES && spread.median > 0.5 && spread.median < 1.5 &&
           spread.deviation < 0.1 * std::sqrt(double(ray_shares.size())))
    findings.push_back(fault("planes are flat only if the numbers are lengths of rays (distance "
                             "from the camera), not depth along the optical axis",
                             "ray_share", spread.median,
                             "convert them: depth = length / sqrt(1 + x^2 + y^2)"));
}

} // namespace bundle_icp
