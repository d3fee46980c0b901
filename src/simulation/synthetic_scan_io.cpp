// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/atomic_file.h>
#include <bundle_icp/io/mesh_io.h>
#include <bundle_icp/io/trajectory.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <boost/filesystem.hpp>
#include <opencv2/imgcodecs.hpp>
#include <pcl/conversions.h>
#include <pcl/exceptions.h>

#include <atomic>
#include <charconv>
#include <exception>
#include <fstream>
#include <omp.h>

namespace bundle_icp {
namespace {

namespace fs = boost::filesystem;

constexpr double DEPTH_SCALE = 5000; // units a metre, as in TUM's recordings

/** Independent of the locale. */
std::string
toText(double number, std::chars_format format, int precision)
{
  char text[64];
  return {text, std::to_chars(text, text + sizeof(text), number, format, precision).ptr};
}

std::string
stampOf(const SyntheticScan& scan, std::size_t index)
{
  return toText(scan.timestamp(index), std::chars_format::fixed, 6);
}

void
writeBytes(const std::string& path, const void* bytes, std::size_t count)
{
  std::ofstream file(path, std::ios::binary);
  file.write(static_cast<const char*>(bytes), std::streamsize(count));
  file.close();
  if (!file)
    throw pcl::IOException("cannot write '" + path + "': disk full or not writable");
}

void
writeText(const std::string& path, const std::string& text)
{
  writeAtomically(path, [&text](const std::string& temporary) {
    writeBytes(temporary, text.data(), text.size());
  });
}

void
writeImage(const std::string& path, const cv::Mat& image)
{
  std::vector<uchar> bytes;
  // Level 1: the time goes into compression otherwise, for a few percent of space.
  cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1});
  writeBytes(path, bytes.data(), bytes.size());
}

void
writeFrame(const SyntheticScan& scan, const fs::path& folder, bool with_mask, std::size_t index)
{
  const RGBDFrame frame = scan.read(index);
  const std::string file = stampOf(scan, index) + ".png";
  cv::Mat units;
  cv::Mat measured = scan.depthCamera() ? scan.readDepth(index) : frame.depth.clone();
  measured.setTo(0, measured != measured); // NaN is written as 0
  measured.convertTo(units, CV_16UC1, DEPTH_SCALE);
  writeImage((folder / "rgb" / file).string(), frame.color);
  writeImage((folder / "depth" / file).string(), units);
  if (with_mask)
    writeImage((folder / "mask" / file).string(), scan.mask(index));
}

/** Writes frames in parallel. \return false when `progress` asked to stop. */
bool
writeFrames(const SyntheticScan& scan, const fs::path& folder, bool with_masks, int threads,
            const ProgressCallback& progress)
{
  std::atomic<bool> stop{false}, cancelled{false};
  std::atomic<std::size_t> done{0};
  std::exception_ptr failure;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
  for (std::int64_t i = 0; i < std::int64_t(scan.size()); ++i) {
    if (stop)
      continue;
    try {
      writeFrame(scan, folder, with_masks, std::size_t(i));
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

std::string
joined(const std::vector<double>& numbers)
{
  std::string text;
  for (const double number : numbers)
    text += (text.empty() ? "" : " ") + toText(number, std::chars_format::general, 9);
  return text;
}

std::string
toText(const CameraIntrinsics& camera)
{
  return joined({camera.fx, camera.fy, camera.cx, camera.cy});
}

void
writeIntrinsics(const SyntheticScan& scan, const fs::path& path)
{
  std::string text = toText(scan.camera());
  text += "\ndepth_scale " + toText(DEPTH_SCALE, std::chars_format::general, 6) + "\n";
  if (const std::optional<DepthCamera> depth = scan.depthCamera()) {
    const Eigen::Vector3d place = depth->color_from_depth.translation();
    text += "depth_intrinsics " + toText(depth->intrinsics) + "\n";
    text += "depth_to_color " + joined({place.x(), place.y(), place.z()}) + "\n";
  }
  writeText(path.string(), text);
}

void
writeLists(const SyntheticScan& scan, const fs::path& folder)
{
  for (const std::string kind : {"rgb", "depth"}) {
    std::string text = "# synthetic scan: timestamp [s], file\n";
    for (std::size_t i = 0; i < scan.size(); ++i)
      text += stampOf(scan, i) + " " + kind + "/" + stampOf(scan, i) + ".png\n";
    writeText((folder / (kind + ".txt")).string(), text);
  }
  writeIntrinsics(scan, folder / "intrinsics.txt");
  writeTrajectory((folder / "groundtruth.txt").string(), scan.groundTruth());
}

void
prepareFolder(const fs::path& folder, bool with_masks)
{
  boost::system::error_code error;
  if (fs::exists(folder, error)) {
    if (!fs::is_directory(folder, error))
      throw pcl::IOException("'" + folder.string() + "' exists and is not a folder");
    const bool is_empty = fs::is_empty(folder, error);
    if (error)
      throw pcl::IOException("cannot read folder '" + folder.string() + "': " + error.message());
    if (!is_empty)
      throw pcl::IOException("folder '" + folder.string() + "' is not empty; nothing was written");
  }
  std::vector<const char*> parts{"rgb", "depth"};
  if (with_masks)
    parts.push_back("mask");
  for (const char* part : parts)
    if (!fs::create_directories(folder / part, error) && error)
      throw pcl::IOException("cannot create folder '" + (folder / part).string() +
                             "': " + error.message());
}

} // namespace

void
writeSyntheticScan(const SyntheticScan& scan, const std::string& folder,
                   const SyntheticScanWriteOptions& options, const ProgressCallback& progress)
{
  std::string error;
  if (!options.isValid(&error))
    throw pcl::BadArgumentException("writing a synthetic scan: " + error);
  prepareFolder(folder, options.masks);
  const int threads = options.num_threads > 0 ? options.num_threads : omp_get_max_threads();
  if (!writeFrames(scan, folder, options.masks, threads, progress))
    return;
  if (options.surface_spacing > 0) {
    if (progress && !progress({"surface", 0, 1}))
      return;
    writeSurface(scan, fs::path(folder) / "surface.ply", options.surface_spacing, threads);
    if (progress && !progress({"surface", 1, 1}))
      return;
  }
  writeLists(scan, folder);
}

} // namespace bundle_icp
