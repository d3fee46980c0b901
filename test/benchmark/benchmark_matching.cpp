// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Features of an image, and matching of two images' descriptors on one core, beside OpenCV's
// matchers.
#include <bundle_icp/graph/feature_matching.h>
#include <bundle_icp/graph/features.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <benchmark/benchmark.h>
#include <opencv2/features2d.hpp>

using namespace bundle_icp;

namespace {

const Features&
featuresOf(std::size_t frame)
{
  static const SyntheticScan scan;
  static const auto extract = [](std::size_t i) {
    return extractFeatures(scan.read(i), scan.camera());
  };
  static const Features first = extract(0), second = extract(2);
  return frame == 0 ? first : second;
}

/** So many descriptors of a real texture, over and over where there are fewer. */
cv::Mat
descriptors(std::size_t frame, int count)
{
  const cv::Mat found = featuresOf(frame).descriptors;
  cv::Mat result;
  while (result.rows < count)
    result.push_back(found);
  return result.rowRange(0, count).clone();
}

void
matchBundleICP(benchmark::State& state)
{
  const cv::Mat first = descriptors(0, int(state.range(0))),
                second = descriptors(2, int(state.range(0)));
  MatchingOptions options;
  options.num_threads = 1;
  for (auto _ : state)
    benchmark::DoNotOptimize(matchDescriptors(first, second, options));
}

/** Two nearest neighbours in both directions, as ratio and mutual test need them. */
void
matchOpenCV(benchmark::State& state, cv::DescriptorMatcher& matcher)
{
  cv::setNumThreads(1);
  cv::Mat first, second;
  descriptors(0, int(state.range(0))).convertTo(first, CV_32F);
  descriptors(2, int(state.range(0))).convertTo(second, CV_32F);
  std::vector<std::vector<cv::DMatch>> forward, backward;
  for (auto _ : state) {
    matcher.knnMatch(first, second, forward, 2);
    matcher.knnMatch(second, first, backward, 1);
    benchmark::DoNotOptimize(forward);
  }
}

void
matchBFMatcher(benchmark::State& state)
{
  cv::BFMatcher matcher(cv::NORM_L2);
  matchOpenCV(state, matcher);
}

void
matchFLANN(benchmark::State& state)
{
  cv::FlannBasedMatcher matcher;
  matchOpenCV(state, matcher);
}

void
extractFromImage(benchmark::State& state)
{
  static const SyntheticScan scan;
  static const RGBDFrame frame = scan.read(0);
  for (auto _ : state)
    benchmark::DoNotOptimize(extractFeatures(frame, scan.camera()));
}

BENCHMARK(matchBundleICP)->Arg(1300)->Unit(benchmark::kMillisecond);
BENCHMARK(matchBFMatcher)->Arg(1300)->Unit(benchmark::kMillisecond);
BENCHMARK(matchFLANN)->Arg(1300)->Unit(benchmark::kMillisecond);
BENCHMARK(extractFromImage)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

} // namespace
