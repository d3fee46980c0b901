// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/baselines/frame_to_model.h>
#include <bundle_icp/common/progress.h>
#include <bundle_icp/graph/image_graph.h>
#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/io/trajectory.h>
#include <bundle_icp/mapping/incremental_mapper.h>
#include <bundle_icp/volume/extract_surface.h>
#include <bundle_icp/volume/object_region.h>
#include <bundle_icp/volume/tsdf_volume.h>

#include <pcl/PolygonMesh.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace bundle_icp {

/** How poses are estimated: the methods that the paper compares (its Table 1). */
enum class ReconstructionMethod {
  F2M_ICP,    ///< "f2m_icp": depth alone, tracked against the model, as in KinectFusion
  VISUAL_ICP, ///< "visual_icp": the same, started from features matched with the frame before
  RGBD_SFM,   ///< "rgbd_sfm": incremental structure from motion with measured depth: PnP and
              ///< bundle adjustment, no ICP
  BUNDLE_ICP  ///< "bundle_icp": the paper's own
};

/** Name of a method, as above. */
BUNDLE_ICP_EXPORT std::string
toString(ReconstructionMethod method);

/** The method of that name, if there is one. */
BUNDLE_ICP_EXPORT std::optional<ReconstructionMethod>
parseReconstructionMethod(const std::string& name);

/** How reconstruct() works: the options of its steps. */
struct BUNDLE_ICP_EXPORT ReconstructionOptions {
  /** The last two take frames in any order, the first two take the order given for that of time. */
  ReconstructionMethod method = ReconstructionMethod::BUNDLE_ICP;
  FeatureOptions features;
  ImageGraphOptions graph;
  MapperOptions mapper; ///< its schedule.ordered_in_time is that of the dataset; RGBD_SFM ignores
                        ///< method, visual_start, dense terms, motion_prior, self_calibration
  TrackingOptions tracking; ///< of F2M_ICP and VISUAL_ICP
  TSDFOptions volume;       ///< from which the mesh is made
  MeshOptions mesh;
  /** When set, the surface is limited to the object on the dominant plane, in place of
   *  volume.region; see findObjectRegion(). */
  std::optional<ObjectRegionOptions> object;
  /** Bundle ICP works on depth images reduced by this integer factor, less where a side would fall
   *  below 120 px. Pixels are averaged, and the noise of neighbours is correlated: at 640x480, 1 is
   *  slower and no more accurate. */
  int depth_reduction = 4;
  /** Without it the volume is neither filled nor meshed. */
  bool make_mesh = true;
  /** Files mesh.EXTENSION that writeReconstruction() makes, see meshFormats(). */
  std::vector<std::string> mesh_formats{"ply"};
  /** Threads of all steps, 0 = all; the num_threads of the steps' own options is ignored. */
  int num_threads = 0;

  bool
  isValid(std::string* error = nullptr) const;

  /** With num_threads handed down to all steps. */
  ReconstructionOptions
  withThreads() const;
};

/** How a reconstruction ended. */
enum class ReconstructionStatus {
  COMPLETED,          ///< all steps ran; see the frames' reports for what is missing
  STOPPED,            ///< the progress callback asked to stop; what was done by then is given
  NOTHING_REGISTERED, ///< no two frames could be connected; each frame says why
  NO_OBJECT           ///< poses are given, but no surface: ReconstructionResult::object says why
};

/** Name of a status, as it is written here. */
BUNDLE_ICP_EXPORT const char*
toString(ReconstructionStatus status);

/** What became of one frame of the recording. */
struct FrameReport {
  std::size_t id = 0;   ///< RGBDFrame::id
  double timestamp = 0; ///< [s]
  std::string name;     ///< RGBDDataset::name()
  bool registered = false;
  int component = -1; ///< 0 is the largest; each has its own world frame
  std::string reason; ///< why it has no pose
  std::size_t features = 0;
  std::size_t matches = 0; ///< visual correspondences to registered frames
  std::size_t inliers = 0; ///< those that agree with the pose
  double icp_rmse =
      0; ///< distance to the virtual depth [m]; 0 = not aligned, see ImageRegistration
  bool by_geometry = false;      ///< registered without visual evidence
  double position_deviation = 0; ///< largest standard deviation in any direction [m]
  double rotation_deviation = 0; ///< ... about any axis [rad]
  Pose world_from_camera = Pose::Identity();
  Pose world_from_depth = Pose::Identity();    ///< pose of the camera when the depth was taken
  DepthError depth_error = DepthError::Zero(); ///< shared by all of its depth
};

/** Everything that a reconstruction yields. The world frame is the camera frame of the earliest
 *  registered frame of component 0. */
struct ReconstructionResult {
  ReconstructionStatus status = ReconstructionStatus::NOTHING_REGISTERED;
  std::vector<FrameReport> frames;          ///< in the order of the dataset
  std::vector<std::size_t> component_sizes; ///< frames in each component
  /** Images: the readable frames. F2M_ICP and VISUAL_ICP have neither graph nor model. Of a scan
   *  that nothing else shares the graph's descriptors are released. */
  std::shared_ptr<const ImageGraph> graph;
  std::vector<std::size_t> frame_of_image; ///< index into `frames` of each image
  SparseModel model;                       ///< with the calibration
  SelfCalibrationResult self_calibration;  ///< what was tested, and what applied
  std::optional<ObjectRegion> object;      ///< when ReconstructionOptions::object asked for it
  pcl::PolygonMesh mesh;  ///< fields of toPolygonMesh(), which has those of PointXYZRGBNormal
  MeshReport mesh_report; ///< how it was cleaned and decimated
  std::vector<std::pair<std::string, double>> timing_s; ///< wall time of each stage [s]
  std::size_t peak_memory_bytes = 0;                    ///< of the process, so far

  /** Poses of the frames of a component. */
  BUNDLE_ICP_EXPORT Trajectory
  trajectory(int component = 0) const;

  /** One line: how many frames have a pose in one world, and how many in others. */
  BUNDLE_ICP_EXPORT std::string
  summary() const;
};

/** What different methods share when they reconstruct the same recording: features, image graph
 *  and prepared depth. Each is made when the first method asks for it; its time counts for every
 *  method that does. */
class BUNDLE_ICP_EXPORT PreparedScan {
public:
  /** \param dataset has to outlive the scan
   *  \param options features, graph, depth_reduction, virtual depth and threads count here
   *  \throws pcl::BadArgumentException for invalid options or an empty dataset. */
  PreparedScan(const RGBDDataset& dataset, const ReconstructionOptions& options);
  ~PreparedScan();

private:
  class Impl;
  friend class Reconstruction;
  std::unique_ptr<Impl> impl_;
};

/** The whole mission: features, image graph, sparse reconstruction by Bundle ICP (or one of the
 *  methods that it is compared with), surface.
 *
 *  The result does not depend on the number of threads, and, but for the methods that track, not
 *  on the order of the frames:
 *  images are treated in an order that follows from their content alone. Time stamps give
 *  the camera's motion, of which rolling shutter and delay of depth follow; where the dataset
 *  isOrdered(), also which images are likely to match, a first guess where there is no visual
 *  evidence, and RefinementOptions::motion_prior. Frames that cannot be read are skipped and named.
 *  \throws pcl::BadArgumentException for invalid options or an empty dataset. */
BUNDLE_ICP_EXPORT ReconstructionResult
reconstruct(const RGBDDataset& dataset, const ReconstructionOptions& options = {},
            const ProgressCallback& progress = {});

/** The same from a scan that other reconstructions share; of the options, those of the scan's
 *  preparation are ignored. When preparation was stopped, all that need it are STOPPED. */
BUNDLE_ICP_EXPORT ReconstructionResult
reconstruct(PreparedScan& scan, const ReconstructionOptions& options,
            const ProgressCallback& progress = {});

/** Writes `report.json`, with poses `trajectory.txt`, `calibration.json` and `trajectory.png`, with
 *  a graph `sparse.ply`, and with a mesh `mesh.EXTENSION` in each format and `mesh.png` into a
 *  folder, which is made if needed. All are written before the first takes the place of an earlier
 *  one: on failure the folder stays as it was. Other files in it stay.
 *  \throws pcl::IOException naming the file and the reason. */
BUNDLE_ICP_EXPORT void
writeReconstruction(const std::string& folder, const RGBDDataset& dataset,
                    const ReconstructionOptions& options, const ReconstructionResult& result);

} // namespace bundle_icp
