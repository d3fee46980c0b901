// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Time a frame of TSDF fusion, memory, and time of marching cubes.
//
//   bundle_icp_benchmark_surface [options of Google Benchmark] SCAN...
//
// With --benchmark_repetitions=N, least_ms_per_frame of the last repetition takes each
// frame's least time of all N.
//
// Each SCAN is a recording with true poses.
#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/volume/tsdf_marching_cubes.h>

#include <benchmark/benchmark.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <limits>
#include <numeric>
#include <vector>

using namespace bundle_icp;

namespace {

// The true pose next in time.
Pose
poseAt(const Trajectory& trajectory, double timestamp)
{
  const auto distance = [timestamp](const TimedPose& pose) {
    return std::abs(pose.timestamp - timestamp);
  };
  return std::min_element(
             trajectory.begin(), trajectory.end(),
             [&](const TimedPose& a, const TimedPose& b) { return distance(a) < distance(b); })
      ->world_from_camera;
}

// One iteration is the whole recording; only the fusion of each frame is timed, in
// seconds, not the reading.
std::shared_ptr<TSDFVolume>
fuse(const RGBDDataset& dataset, const TSDFOptions& options, std::vector<double>& seconds)
{
  using Clock = std::chrono::steady_clock;
  const Trajectory trajectory = dataset.groundTruth();
  auto volume = std::make_shared<TSDFVolume>(options);
  seconds.clear();
  for (std::size_t i = 0; i < dataset.size(); ++i) {
    const RGBDFrame frame = dataset.read(i);
    const Pose pose = poseAt(trajectory, dataset.timestamp(i));
    const auto start = Clock::now();
    volume->integrate(frame, dataset.camera(), pose);
    seconds.push_back(std::chrono::duration<double>(Clock::now() - start).count());
  }
  return volume;
}

// Each frame's least time of all repetitions is in `least`: what it takes where others
// use the machine for part of the time.
void
integrate(benchmark::State& state, const RGBDDataset::ConstPtr& dataset, const TSDFOptions& options,
          std::vector<double>& least)
{
  const auto sum = [](const std::vector<double>& times) {
    return std::accumulate(times.begin(), times.end(), 0.0);
  };
  for (auto _ : state) {
    std::vector<double> seconds;
    const auto volume = fuse(*dataset, options, seconds);
    least.resize(seconds.size(), std::numeric_limits<double>::infinity());
    std::transform(seconds.begin(), seconds.end(), least.begin(), least.begin(),
                   [](double a, double b) { return std::min(a, b); });
    state.SetIterationTime(sum(seconds));
    state.counters["ms_per_frame"] = 1e3 * sum(seconds) / double(dataset->size());
    state.counters["least_ms_per_frame"] = 1e3 * sum(least) / double(dataset->size());
    state.counters["blocks"] = double(volume->numBlocks());
    state.counters["MB"] = double(volume->memoryBytes()) / 1e6;
  }
}

void
march(benchmark::State& state, const RGBDDataset::ConstPtr& dataset)
{
  std::vector<double> unused;
  const auto volume = fuse(*dataset, {}, unused);
  for (auto _ : state) {
    const SurfaceMesh mesh = extractSurface(*volume);
    state.counters["vertices"] = double(mesh.vertices.size());
  }
}

void
reconstructMesh(benchmark::State& state, const RGBDDataset::ConstPtr& dataset)
{
  std::vector<double> unused;
  TSDFMarchingCubes<pcl::PointXYZRGBNormal> cubes;
  cubes.setVolume(fuse(*dataset, {}, unused));
  for (auto _ : state) {
    pcl::PolygonMesh mesh;
    cubes.reconstruct(mesh);
    state.counters["triangles"] = double(mesh.polygons.size());
  }
}

void
registerScan(const std::string& path)
{
  const RGBDDataset::ConstPtr dataset = openDataset(path);
  if (dataset->groundTruth().empty())
    throw std::runtime_error(path + ": has no poses");
  const auto add = [&](const std::string& name, auto function) {
    return benchmark::RegisterBenchmark((name + " " + path).c_str(),
                                        [=](benchmark::State& state) { function(state, dataset); })
        ->Unit(benchmark::kMillisecond)
        ->MeasureProcessCPUTime();
  };
  const auto addIntegrate = [&](const std::string& name, const TSDFOptions& options) {
    const auto least = std::make_shared<std::vector<double>>();
    add(name, [=](benchmark::State& state,
                  const RGBDDataset::ConstPtr& scan) { integrate(state, scan, options, *least); })
        ->UseManualTime()
        ->Iterations(1);
  };
  addIntegrate("integrate", {});
  TSDFOptions to_three_metres; // what the figures of others are measured with
  to_three_metres.max_depth = 3;
  addIntegrate("integrate/3m", to_three_metres);
  add("extractSurface", march)->UseRealTime();
  add("TSDFMarchingCubes", reconstructMesh)->UseRealTime();
}

} // namespace

int
main(int argc, char** argv)
{
  benchmark::Initialize(&argc, argv);
  if (argc < 2) {
    std::cerr << "Usage: " << argv[0] << " [--benchmark_...] SCAN...\n";
    return 2;
  }
  try {
    for (int i = 1; i < argc; ++i)
      registerScan(argv[i]);
  }
  catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
