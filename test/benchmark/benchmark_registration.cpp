// SPDX-License-Identifier: BSD-3-Clause
// Virtual depth and registration at 640 x 480.
#include <bundle_icp/registration/bundle_icp.h>
#include <bundle_icp/simulation/synthetic_scan.h>
#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <benchmark/benchmark.h>

using namespace bundle_icp;

namespace {

const SyntheticScan&
scan()
{
  static const SyntheticScan held;
  return held;
}

VirtualDepthOptions
optionsFor(const benchmark::State& state)
{
  VirtualDepthOptions options;
  options.num_threads = int(state.range(0));
  return options;
}

void
prepareDepthView(benchmark::State& state)
{
  const cv::Mat depth = scan().read(0).depth;
  const VirtualDepthOptions options = optionsFor(state);
  for (auto _ : state)
    benchmark::DoNotOptimize(makeDepthView(depth, scan().camera(), int(state.range(1)), options));
}

void
renderEightViews(benchmark::State& state)
{
  const VirtualDepthOptions options = optionsFor(state);
  const int reduction = int(state.range(1));
  std::vector<DepthView> views;
  for (std::size_t i = 0; i < 8; ++i)
    views.push_back(makeDepthView(scan().read(3 * i).depth, scan().camera(), reduction));
  std::vector<RegisteredView> registered;
  for (std::size_t i = 0; i < 8; ++i)
    registered.push_back({&views[i], scan().worldFromCamera(3 * i)});
  for (auto _ : state)
    benchmark::DoNotOptimize(
        renderVirtualDepth(registered, views[0].camera, scan().worldFromCamera(10), options));
}

void
alignFromFiveDegrees(benchmark::State& state)
{
  using Point = pcl::PointXYZRGBNormal;
  const auto cloud = [](std::size_t i) {
    return toPointCloud(makeDepthView(scan().read(i).depth, scan().camera()));
  };
  const auto source = cloud(5), target = cloud(3);
  Vector6d offset;
  offset << 0.05, 0.05, 0.05, 0.03, 0.03, 0.03;
  const Pose guess =
      scan().worldFromCamera(3).inverse() * scan().worldFromCamera(5) * increment(offset);
  BundleICP<Point, Point> reg;
  reg.setNumberOfThreads(int(state.range(0)));
  reg.setCameraIntrinsics(scan().camera());
  reg.setInputSource(source);
  reg.setInputTarget(target);
  pcl::PointCloud<Point> aligned;
  for (auto _ : state)
    reg.align(aligned, guess.matrix().cast<float>());
  state.counters["iterations"] = reg.getResult().iterations;
}

BENCHMARK(prepareDepthView)
    ->Args({1, 1})
    ->Args({2, 1})
    ->Args({1, 2})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(renderEightViews)
    ->Args({1, 1})
    ->Args({2, 1})
    ->Args({2, 2})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(alignFromFiveDegrees)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

} // namespace
