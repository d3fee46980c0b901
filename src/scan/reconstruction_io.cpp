// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/reconstruction.h>

#include "common/parallel.h"
#include "io/text_file.h"
#include "mesh/preview.h"
#include "scan/reconstruction_report.h"

#include <bundle_icp/io/atomic_file.h>
#include <bundle_icp/io/calibration_io.h>
#include <bundle_icp/io/mesh_io.h>
#include <bundle_icp/model/sparse_model_io.h>

#include <boost/algorithm/string/replace.hpp>
#include <boost/filesystem.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <pcl/exceptions.h>

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
      throw pcl::IOException(path + ": cannot be written, is the disk full?");
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

void
writeFiles(const std::string& prefix, const RGBDDataset& dataset,
           const ReconstructionOptions& options, const ReconstructionResult& result)
{
  writeText(prefix + "report.json", makeReport(dataset, options, result).dump(2) + "\n");
  if (result.component_sizes.empty())
    return;
  writeCalibration(prefix + "calibration.json", result.model.calibration(), dataset.camera());
  writeTrajectory(prefix + "trajectory.txt", result.trajectory());
  if (result.graph)
    writeSparseModel(prefix + "sparse.ply", *result.graph, result.model);
  writeMeshAndPictures(prefix, options, result);
}

/** A hidden folder in the results' folder, removed at the end with what is left in it. */
class StagingFolder {
public:
  explicit StagingFolder(const fs::path& folder)
  : folder_(folder), path_(folder / fs::unique_path(".bundle_icp_%%%%%%%%"))
  {
    boost::system::error_code error;
    fs::create_directories(path_, error);
    if (error)
      throw pcl::IOException(folder.string() + ": cannot be written: " + error.message());
  }

  ~StagingFolder()
  {
    boost::system::error_code ignored;
    fs::remove_all(path_, ignored);
  }

  StagingFolder(const StagingFolder&) = delete;
  StagingFolder&
  operator=(const StagingFolder&) = delete;

  std::string
  prefix() const
  {
    return path_.string() + "/";
  }

  /** Gives every file its place. A file of an earlier result that this one does not have is
   *  removed: it would pass for a part of this one. */
  void
  publish() const
  {
    std::vector<std::string> names{"mesh.png", "trajectory.png", "trajectory.txt",
                                   "calibration.json", "sparse.ply"};
    for (const std::string& format : meshFormats())
      names.push_back("mesh." + format);
    for (const std::string& name : names)
      if (boost::system::error_code ignored; !fs::exists(path_ / name))
        fs::remove(folder_ / name, ignored);
    for (const fs::directory_entry& entry : fs::directory_iterator(path_))
      writeAtomically((folder_ / entry.path().filename()).string(),
                      [&](const std::string& temporary) { fs::rename(entry.path(), temporary); });
  }

private:
  fs::path folder_, path_;
};

} // namespace

void
writeReconstruction(const std::string& folder, const RGBDDataset& dataset,
                    const ReconstructionOptions& options, const ReconstructionResult& result)
{
  // All is written before anything is replaced: a disk that fills up leaves the results of an
  // earlier run complete.
  const StagingFolder staging(folder);
  try {
    writeFiles(staging.prefix(), dataset, options, result);
  }
  catch (const pcl::IOException& error) {
    throw pcl::IOException(
        boost::replace_all_copy(messageOf(error), staging.prefix(), folder + "/"));
  }
  staging.publish();
}

} // namespace bundle_icp
