// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/baselines/frame_to_model.h>
#include <bundle_icp/common/finding.h>
#include <bundle_icp/common/progress.h>
#include <bundle_icp/graph/image_graph.h>
#include <bundle_icp/graph/own_features.h>
#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/io/trajectory.h>
#include <bundle_icp/mapping/incremental_mapper.h>
#include <bundle_icp/refinement/frame_verdict.h>
#include <bundle_icp/scan/next_views.h>
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

/** How poses are estimated: the methods that Table 1 of the paper compares. */
enum class ReconstructionMethod {
  F2M_ICP,    ///< "f2m_icp": depth alone, tracked against the model, as in KinectFusion
  VISUAL_ICP, ///< "visual_icp": as F2M_ICP, started from features matched with the frame before
  RGBD_SFM,   ///< "rgbd_sfm": incremental structure from motion with measured depth: PnP and
              ///< bundle adjustment, no ICP
  BUNDLE_ICP  ///< "bundle_icp": the paper's own method
};

/** Name of a method, as in the comments above. */
BUNDLE_ICP_EXPORT std::string
toString(ReconstructionMethod method);

/** The method of that name, if there is one. */
BUNDLE_ICP_EXPORT std::optional<ReconstructionMethod>
parseReconstructionMethod(const std::string& name);

/** What moves in a recording, and what the poses and the surface are those of. */
enum class MovingPart {
  CAMERA, ///< the camera; what else moves is left out
  OBJECT  ///< a thing before a camera that stands still, on a turntable or in hands: the
          ///< surroundings are left out, and poses are those of the camera relative to the thing
};

/** Poses that are taken as they are. */
struct BUNDLE_ICP_EXPORT GivenPoses {
  /** Poses of the colour camera, matched with frames by time. The world is theirs. */
  Trajectory trajectory;
  std::string source = "the options"; ///< where they come from, for messages
  double max_time_difference = 0.02;  ///< largest time between a frame and its pose [s]

  bool
  isValid(std::string* error = nullptr) const;
};

/** Where reconstruct() keeps features and matches. */
struct ScanDatabaseOptions {
  std::string path;   ///< file (SQLite, with the tables of COLMAP), made where it is missing
  bool fresh = false; ///< true: what the file holds is forgotten
  /** Files of other runs, features and matches of which are copied first. */
  std::vector<std::string> sources = {};
};

/** How reconstruct() works: the options of its steps. */
struct BUNDLE_ICP_EXPORT ReconstructionOptions {
  /** F2M_ICP and VISUAL_ICP need frames in time order; the other methods take any order. */
  ReconstructionMethod method = ReconstructionMethod::BUNDLE_ICP;
  MovingPart moving = MovingPart::CAMERA; ///< OBJECT: not with F2M_ICP
  /** When set, the surface is made with these poses alone: no features, no registration and no
   *  verification; not with `method` nor with `moving`. Frames without a pose are left out. */
  std::optional<GivenPoses> poses;
  FeatureOptions features;
  /** Finds features in place of extractFeatures() when set; makeFeatures() and toDescriptors()
   *  help. A frame for which it throws, or gives features that do not fit together, gets no pose,
   *  and the frame's report says why. Estimation of intrinsics keeps to SIFT. */
  FeatureFinder find_features;
  ImageGraphOptions graph;
  MapperOptions mapper; ///< schedule.ordered_in_time is taken from the dataset; RGBD_SFM ignores
                        ///< method, visual_start, dense terms, motion_prior, pose_prior,
                        ///< join_by_geometry and self_calibration
  TrackingOptions tracking; ///< for F2M_ICP and VISUAL_ICP
  TSDFOptions volume;       ///< volume that the mesh is made from
  MeshOptions mesh;
  /** When set, the surface is limited to the object on the dominant plane, see findObjectRegion().
   *  volume.region is then ignored. */
  std::optional<ObjectRegionOptions> object;
  /** When set, views are suggested that would add to the scan, see suggestViews(); needs make_mesh.
   *  Their region gives way to that of the surface. */
  std::optional<NextViewOptions> next_views;
  /** When set, features and matches are kept on disk, and a later run takes what the same pixels,
   *  camera and options have given; the result is the same as without. Not with find_features, nor
   *  where no features are found. */
  std::optional<ScanDatabaseOptions> database;
  /** Bundle ICP works on depth images reduced by this integer factor, or by less where a side would
   *  fall below 120 px. The reduction averages pixels, and the noise of neighbouring pixels is
   *  correlated: at 640x480, a factor of 1 is slower and no more accurate. */
  int depth_reduction = 4;
  /** False: the volume is neither filled nor meshed. */
  bool make_mesh = true;
  /** Formats of the meshes that writeReconstruction() writes, see meshFormats(). */
  std::vector<std::string> mesh_formats{"ply"};
  /** Threads of all steps, 0 = all. The num_threads of each step's options is ignored. */
  int num_threads = 0;
  /** Memory that a run is to take [bytes], at least 2^20; 0 = half of what is free when it begins.
   *  Reduced depth images and descriptors, which grow with the number of frames, keep to three
   *  eighths of it, and lie in a temporary file beyond that; the rest is for the library itself,
   *  positions and matches of features, points and poses. The surface grows with the scene and is
   *  not bounded: a finding of kind `memory` says when its voxels alone take more. The result is
   *  the same, bit by bit. graph.matching.max_memory is ignored. */
  std::size_t max_memory = 0;
  /** Folder of the temporary file, which has no name and is gone with the process; empty = the
   *  system's for temporary files. One that lies in memory (tmpfs) saves none. */
  std::string temporary_folder;

  bool
  isValid(std::string* error = nullptr) const;

  /** The same options with num_threads copied into the options of all steps. */
  ReconstructionOptions
  withThreads() const;
};

/** How a reconstruction ended. */
enum class ReconstructionStatus {
  COMPLETED,          ///< all steps ran; the frames' reports say what is missing
  STOPPED,            ///< the progress callback asked to stop; work done by then is in the result
  NOTHING_REGISTERED, ///< no two frames could be connected; each frame's report gives the reason
  NO_OBJECT           ///< poses but no surface; ReconstructionResult::object gives the reason
};

/** Name of a status, as it is written here. */
BUNDLE_ICP_EXPORT const char*
toString(ReconstructionStatus status);

/** Outcome of one frame of the recording: its final pose, and what supported the pose when it was
 *  registered. With BUNDLE_ICP and RGBD_SFM, covariance and deviations are those of the final pose
 *  relative to the earliest frame of its component, whose camera is the world: from all evidence of
 *  the last adjustment and the motion prior, with points and calibration unknown. */
struct FrameReport : FrameRegistration {
  std::size_t id = 0;   ///< RGBDFrame::id
  double timestamp = 0; ///< [s]
  std::string name;     ///< RGBDDataset::name()
  int component = -1;   ///< 0 is the largest component; each component has its own world frame
  std::size_t features = 0;
  Pose world_from_depth = Pose::Identity();      ///< camera pose when the depth image was taken
  FrameVerdict verdict = FrameVerdict::LEFT_OUT; ///< what the other frames say of the pose
  std::string doubt;                             ///< why the pose is doubtful
  /** Share of its depth that agrees with what other frames saw there, 0 ... 1; the rest lies in
   *  space that others looked through, or others' depth lies in space that it looked through. Unset
   *  when nothing was compared. */
  std::optional<double> depth_agreement;
  /** Share of its depth that shows something that moves, which the surface leaves out. */
  double moving_share = 0;
};

/** What a run took from ReconstructionOptions::database. */
struct ReusedWork {
  std::size_t features = 0; ///< frames whose features were known
  std::size_t pairs = 0;    ///< pairs of frames that were matched before
  bool poses = false;       ///< whether registration went on from what it had found before
};

/** Result of reconstruct(). The world frame is the camera frame of the earliest registered frame of
 *  component 0, or that of ReconstructionOptions::poses. */
struct ReconstructionResult {
  ReconstructionStatus status = ReconstructionStatus::NOTHING_REGISTERED;
  /** What a user should know: what the dataset's reader found, and what verification of the final
   *  poses says of them. */
  std::vector<Finding> findings;
  std::vector<FrameReport> frames;          ///< in the order of the dataset
  std::vector<std::size_t> component_sizes; ///< frames in each component
  /** Its nodes are the frames that could be read; F2M_ICP, VISUAL_ICP and given poses make no graph
   *  and no model. Unless a PreparedScan shares the graph, its descriptors are released. */
  std::shared_ptr<const ImageGraph> graph;
  /** For each node of the graph, the index of its frame in `frames`. */
  std::vector<std::size_t> frame_of_node;
  SparseModel model;                      ///< sparse model, calibration included
  SelfCalibrationResult self_calibration; ///< corrections that were tested and applied
  PosePriorReport pose_prior;             ///< what the dataset's prior poses were worth
  std::vector<ComponentJoint> joints;     ///< parts that were joined by their shape, in order
  std::optional<ObjectRegion> object;     ///< set when ReconstructionOptions::object asks for it
  pcl::PolygonMesh mesh;  ///< fields of toPolygonMesh(), among them those of PointXYZRGBNormal
  MeshReport mesh_report; ///< how the mesh was cleaned and decimated
  std::vector<NextView> next_views; ///< where ReconstructionOptions::next_views asks for them
  /** Poses as ScanSession gave them when the frames came; empty without a session. */
  Trajectory live_trajectory;
  ReusedWork reused; ///< by this run, which gives the same with and without
  std::vector<std::pair<std::string, double>> timing_s; ///< wall time of each stage [s]
  std::size_t peak_memory_bytes = 0;                    ///< peak memory of the process so far

  /** Whether the result can be trusted, as the findings say. */
  BUNDLE_ICP_EXPORT Verdict
  verdict() const;

  /** Poses of the frames of a component. */
  BUNDLE_ICP_EXPORT Trajectory
  trajectory(int component = 0) const;

  /** One line: the number of frames with a pose in one world, those in other worlds, and those
   *  whose pose is doubtful. */
  BUNDLE_ICP_EXPORT std::string
  summary() const;
};

/** Data that several methods share when they reconstruct the same recording: features, image graph
 *  and prepared depth. The first method that needs a part makes it; the part's time counts for
 *  every method that uses it. */
class BUNDLE_ICP_EXPORT PreparedScan {
public:
  /** \param dataset has to outlive the scan
   *  \param options only moving, features, graph, depth_reduction, virtual depth, threads,
   *  database and memory have an effect; a database is used where method and poses need features
   *  \throws pcl::BadArgumentException for invalid options or an empty dataset, and
   *  pcl::IOException when the file of options.database cannot be used. */
  PreparedScan(const RGBDDataset& dataset, const ReconstructionOptions& options);
  ~PreparedScan();

private:
  class Impl;
  friend class Reconstruction;
  std::unique_ptr<Impl> impl_;
};

/** The whole method: features, image graph, sparse reconstruction by Bundle ICP (or by one of the
 *  methods that it is compared with), surface.
 *
 *  The result does not depend on the number of threads. With BUNDLE_ICP and RGBD_SFM it does not
 *  depend on the order of the frames either: the content of the images alone decides their order of
 *  treatment. Time stamps give the camera's motion, which rolling shutter and delay of depth need.
 *  If the dataset isOrdered(), they also tell which images are likely to match, give a first guess
 *  where visual evidence is missing, and serve RefinementOptions::motion_prior. Frames that cannot
 *  be read are skipped and reported.
 *  The dataset's prior poses serve RefinementOptions::pose_prior.
 *  \throws pcl::BadArgumentException for invalid options, an empty dataset, an invalid prior, or
 *  given poses none of which fits a frame in time, and pcl::IOException
 *  when the file of options.database cannot be used or written, or the temporary file cannot. */
BUNDLE_ICP_EXPORT ReconstructionResult
reconstruct(const RGBDDataset& dataset, const ReconstructionOptions& options = {},
            const ProgressCallback& progress = {});

/** The same from a shared scan. Options of the scan's preparation are ignored. If preparation was
 *  stopped, the methods that need it give STOPPED. */
BUNDLE_ICP_EXPORT ReconstructionResult
reconstruct(PreparedScan& scan, const ReconstructionOptions& options,
            const ProgressCallback& progress = {});

/** Makes a folder ready for writeReconstruction(), so that minutes of work are not in vain: makes
 *  it where needed, and finishes what a killed run began to write there.
 *  \throws pcl::IOException naming the folder or file that cannot be written, and the reason. */
BUNDLE_ICP_EXPORT void
prepareResultFolder(const std::string& folder);

/** Writes into a folder, which is made if needed: `report.json`; with poses `trajectory.txt`,
 *  `calibration.json` and `trajectory.png`; with a graph `sparse.ply`; with a mesh `mesh.png` and
 *  `mesh.EXTENSION` in each format; of suggested views `next_01.png` and so on; of a session
 *  `trajectory_live.txt`. All files are complete before the first replaces an older one; the
 *  report, which lists them with size and CRC-32, comes last. On failure the folder stays as it
 *  was; when the process is killed, the next prepareResultFolder() makes it wholly old or new.
 *  Files of these names that this result does not have are removed; other files in the folder stay.
 *  \throws pcl::IOException naming the file and the reason. */
BUNDLE_ICP_EXPORT void
writeReconstruction(const std::string& folder, const RGBDDataset& dataset,
                    const ReconstructionOptions& options, const ReconstructionResult& result);

} // namespace bundle_icp
