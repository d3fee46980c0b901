// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/mesh_io.h>

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include "simulation/scan_layouts.h"
#include "simulation/written_files.h"

#include <boost/filesystem.hpp>
#include <pcl/conversions.h>

#include <atomic>
#include <exception>
#include <omp.h>
#include <set>

namespace bundle_icp {
namespace {

namespace fs = boost::filesystem;

void
writeFrame(const SyntheticScan& scan, const ScanLayout& layout, const fs::path& folder,
           bool with_mask, std::size_t index)
{
  const RGBDFrame frame = scan.read(index);
  cv::Mat units;
  cv::Mat measured = scan.depthCamera() ? scan.readDepth(index) : frame.depth.clone();
  measured.setTo(0, measured != measured); // NaN is written as 0
  measured.convertTo(units, CV_16UC1, layout.units_per_metre);
  const std::string color = nameOfFrame(layout.color_file, scan, index);
  if (!color.empty()) {
    writeImage((folder / color).string(), frame.color);
    writeImage((folder / nameOfFrame(layout.depth_file, scan, index)).string(), units);
  }
  if (layout.write_frame)
    layout.write_frame(scan, {index, frame.color, units}, folder);
  if (with_mask) {
    const std::string name = color.empty() ? withZeros(index, 6) : fs::path(color).stem().string();
    writeImage((folder / "mask" / name).string() + ".png", scan.mask(index));
  }
}

/** Writes frames in parallel. \return false when `progress` asked to stop. */
bool
writeFrames(const SyntheticScan& scan, const ScanLayout& layout, const fs::path& folder,
            const SyntheticScanWriteOptions& options, const ProgressCallback& progress)
{
  std::atomic<bool> stop{false}, cancelled{false};
  std::atomic<std::size_t> done{0};
  std::exception_ptr failure;
  const int threads = options.num_threads > 0 ? options.num_threads : omp_get_max_threads();
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
  for (std::int64_t i = 0; i < std::int64_t(scan.size()); ++i) {
    if (stop)
      continue;
    try {
      writeFrame(scan, layout, folder, options.masks, std::size_t(i));
      ++done;
      // Thread 0 is the one that made the call.
      if (omp_get_thread_num() == 0 && progress && !progress({"frames", done, scan.size()}))
        stop = cancelled = true;
    }
    catch (...) {
#pragma omp critical(bundle_icp_write_frames)
      failure = std::current_exception();
      stop = true;
    }
  }
  if (failure)
    std::rethrow_exception(failure);
  return !cancelled && (!progress || progress({"frames", done, scan.size()}));
}

void
writeSurface(const SyntheticScan& scan, const fs::path& path, double spacing, int threads)
{
  pcl::PolygonMesh surface;
  pcl::toPCLPointCloud2(*scan.visibleSurface(spacing, threads), surface.cloud);
  writeMesh(path.string(), surface);
}

void
prepareFolder(const SyntheticScan& scan, const ScanLayout& layout, const fs::path& folder,
              bool with_masks)
{
  boost::system::error_code error;
  if (fs::exists(folder, error)) {
    if (!fs::is_directory(folder, error))
      throw IOException("'" + folder.string() + "' exists and is not a folder");
    const bool is_empty = fs::is_empty(folder, error);
    if (error)
      throw IOException("cannot read folder '" + folder.string() + "': " + error.message());
    if (!is_empty)
      throw IOException("folder '" + folder.string() + "' is not empty; nothing was written");
  }
  std::set<fs::path> places{folder};
  for (const char* const file : {layout.color_file, layout.depth_file})
    if (const std::string name = nameOfFrame(file, scan, 0); !name.empty())
      places.insert((folder / name).parent_path());
  for (const char* const place : layout.other_folders)
    places.insert(folder / place);
  if (with_masks)
    places.insert(folder / "mask");
  for (const fs::path& place : places)
    if (!fs::create_directories(place, error) && error)
      throw IOException("cannot create folder '" + place.string() + "': " + error.message());
}

} // namespace

void
writeSyntheticScan(const SyntheticScan& scan, const std::string& folder,
                   const SyntheticScanWriteOptions& options, const ProgressCallback& progress)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("writing a synthetic scan: " + error);
  const ScanLayout& layout = *findScanLayout(options.format);
  if (depthViewOf(scan) > layout.depth_view)
    throw BadArgumentException("writing a synthetic scan: the format " + options.format +
                               " cannot say what camera took the depth");
  prepareFolder(scan, layout, folder, options.masks);
  if (!writeFrames(scan, layout, folder, options, progress))
    return;
  if (options.surface_spacing > 0) {
    if (progress && !progress({"surface", 0, 1}))
      return;
    writeSurface(scan, fs::path(folder) / "surface.ply", options.surface_spacing,
                 options.num_threads);
    if (progress && !progress({"surface", 1, 1}))
      return;
  }
  if (layout.write_lists)
    layout.write_lists(scan, folder);
}

} // namespace bundle_icp
