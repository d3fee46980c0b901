// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/reconstruction.h>

#include "common/concatenate.h"
#include "common/parallel.h"
#include "io/file_system.h"
#include "io/staging_folder.h"
#include "io/text_file.h"
#include "mesh/preview.h"
#include "scan/reconstruction_report.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/io/atomic_file.h>
#include <bundle_icp/io/calibration_io.h>
#include <bundle_icp/io/mesh_io.h>
#include <bundle_icp/model/sparse_model_io.h>

#include <boost/algorithm/string/replace.hpp>
#include <boost/crc.hpp>
#include <boost/filesystem.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include <fstream>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

void
writeText(const std::string& path, const std::string& text)
{
  writeAtomically(path, [&](const std::string& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    file << text;
    if (!file.flush())
      throw IOException(path + ": cannot be written, is the disk full?");
  });
}

void
writeImage(const std::string& path, const cv::Mat& image)
{
  // Encoded here: cv::imwrite() does not say why it failed, and libpng prints.
  std::vector<unsigned char> bytes;
  cv::imencode(".png", image, bytes);
  writeText(path, std::string(bytes.begin(), bytes.end()));
}

/** The mesh, and the scan at a glance for people without a mesh viewer at hand. */
void
writeMeshAndPictures(const std::string& prefix, const ReconstructionOptions& options,
                     const ReconstructionResult& result)
{
  std::vector<Pose> poses;
  for (const TimedPose& pose : result.trajectory())
    poses.push_back(pose.world_from_camera);
  const auto writeMeshes = [&] {
    for (const std::string& format : options.mesh_formats)
      writeMesh(prefix + "mesh." + format, result.mesh);
  };
  const auto writePreviews = [&] {
    writeImage(prefix + "trajectory.png", drawTrajectory(poses));
    if (!result.mesh.polygons.empty())
      writeImage(prefix + "mesh.png", drawMesh(toSurfaceMesh(result.mesh), poses));
  };
  parallelFor(2, options.num_threads, {}, [&](std::size_t k) {
    if (k == 1)
      writePreviews();
    else if (!result.mesh.polygons.empty())
      writeMeshes();
  });
}

/** Name of the picture of a suggested view. */
std::string
pictureName(std::size_t next_view)
{
  return concatenate("next_", next_view + 1 < 10 ? "0" : "", next_view + 1, ".png");
}

/** All files that a result can have. The report comes last: it tells that all are there. */
std::vector<std::string>
resultFiles()
{
  std::vector<std::string> names{"trajectory.txt", "trajectory_live.txt", "calibration.json",
                                 "sparse.ply",     "trajectory.png",      "mesh.png"};
  for (const std::string& format : meshFormats())
    names.push_back("mesh." + format);
  for (std::size_t i = 0; i < NextViewOptions::MAX_VIEWS; ++i)
    names.push_back(pictureName(i));
  names.push_back("report.json");
  return names;
}

void
writeFiles(const std::string& prefix, const RGBDDataset& dataset,
           const ReconstructionOptions& options, const ReconstructionResult& result)
{
  if (result.component_sizes.empty())
    return;
  writeCalibration(prefix + "calibration.json", result.model.calibration(), dataset.camera());
  writeTrajectory(prefix + "trajectory.txt", result.trajectory());
  if (!result.live_trajectory.empty())
    writeTrajectory(prefix + "trajectory_live.txt", result.live_trajectory);
  if (result.graph)
    writeSparseModel(prefix + "sparse.ply", *result.graph, result.model);
  writeMeshAndPictures(prefix, options, result);
  for (std::size_t i = 0; i < result.next_views.size(); ++i)
    writeImage(prefix + pictureName(i), result.next_views[i].picture);
}

/** Size and checksum of each file, by which a reader can tell that they belong together. */
nlohmann::ordered_json
listFiles(const std::string& prefix)
{
  nlohmann::ordered_json files = nlohmann::ordered_json::array();
  for (const std::string& name : resultFiles()) {
    if (!fs::exists(prefix + name))
      continue;
    const std::string bytes = readBytes(prefix + name, ~std::uint64_t(0));
    boost::crc_32_type crc;
    crc.process_bytes(bytes.data(), bytes.size());
    files.push_back({{"name", name}, {"bytes", bytes.size()}, {"crc32", crc.checksum()}});
  }
  return files;
}

} // namespace

void
prepareResultFolder(const std::string& folder)
{
  makeFolder(folder);
  finishPublishing(folder);
  checkTargets(folder, resultFiles());
  const fs::path probe = createBeside(fs::absolute(fs::path(folder) / "probe"), folder);
  boost::system::error_code ignored;
  fs::remove(probe, ignored);
}

void
writeReconstruction(const std::string& folder, const RGBDDataset& dataset,
                    const ReconstructionOptions& options, const ReconstructionResult& result)
{
  // All is written before anything is replaced: a disk that fills up leaves the results of an
  // earlier run complete.
  const StagingFolder staging(folder);
  try {
    writeFiles(staging.prefix(), dataset, options, result);
    nlohmann::ordered_json report = makeReport(dataset, options, result);
    report["files"] = listFiles(staging.prefix());
    writeText(staging.prefix() + "report.json", report.dump(2) + "\n");
  }
  catch (const pcl::IOException& error) {
    throw IOException(boost::replace_all_copy(messageOf(error), staging.prefix(), folder + "/"));
  }
  staging.publish(resultFiles());
}

} // namespace bundle_icp
