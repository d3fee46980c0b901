// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/reconstruction.h>

#include <pcl/PolygonMesh.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace bundle_icp {

/** What a ScanSession knows of the pose of a frame at the time of the frame. */
enum class LiveStatus {
  GOOD,     ///< the frame's depth lies on what is registered, and holds the pose
  DOUBTFUL, ///< the best pose that was found, but the evidence does not suffice
  LOST      ///< no pose
};

/** Name of a status: "good", "doubtful", "lost". */
BUNDLE_ICP_EXPORT const char*
toString(LiveStatus status);

/** Pose of a frame as it is known when the frame comes. */
struct LivePose {
  std::size_t frame = 0; ///< number of the frame in the session, from 0
  double timestamp = 0;  ///< [s]
  LiveStatus status = LiveStatus::LOST;
  std::string reason; ///< why it is doubtful or lost
  /** The world is the camera of the first frame with depth; of a lost frame, the identity. */
  Pose world_from_camera = Pose::Identity();
  /** Largest standard deviation in any direction, given the model: of the camera's position [m] and
   *  of its rotation [rad]. Infinite when lost. */
  double position_deviation = std::numeric_limits<double>::infinity();
  double rotation_deviation = std::numeric_limits<double>::infinity();
  double icp_rmse = 0;       ///< RMS distance to the virtual depth [m]
  double overlap = 0;        ///< share of the frame's depth that lies on the virtual depth
  bool by_features = false;  ///< features gave the start, because motion did not suffice
  std::size_t inliers = 0;   ///< visual correspondences that agree with the pose
  bool is_key_frame = false; ///< the model is extended by this frame
};

/** How a ScanSession works. */
struct BUNDLE_ICP_EXPORT ScanSessionOptions {
  /** What finish() does. Its features, tracks, registration, adjustment and calibration serve while
   *  one scans as well, its volume and mesh serve ScanSession::mesh(). Needs BUNDLE_ICP, a moving
   *  camera and no given poses. */
  ReconstructionOptions reconstruction;
  /** Key frames whose depth makes the virtual depth that a frame is aligned with. */
  std::size_t max_views = 3;
  /** Edge of the cells of ScanSession::cloud(): one point in each [m]. */
  double cloud_spacing = 0.01;
  /** True: addFrame() waits until the model holds the key frames before, which makes its results
   *  the same in each run. False: it never waits. */
  bool wait_for_mapping = false;

  bool
  isValid(std::string* error = nullptr) const;
};

/** What a session has registered so far. */
struct LiveModel {
  std::size_t frames = 0;     ///< that were added
  std::size_t key_frames = 0; ///< in the model
  std::size_t waiting = 0;    ///< key frames that are not in the model yet
  std::size_t edges = 0;      ///< of the image graph
  Trajectory trajectory;      ///< of the key frames, in the order of time
  /** Points of the sparse model, world frame [m]. */
  pcl::PointCloud<pcl::PointXYZRGB>::Ptr points;
};

/** A scan that goes on: gives the pose of each frame when it comes, and all at the end.
 *
 *  addFrame() aligns a frame by Bundle ICP with the virtual depth of the key frames that see the
 *  same, and then looks where its image shows their points. Where motion does not lead near enough,
 *  it finds features and matches them with those of key frames; so does it find its way back after
 *  a loss. A thread of the session builds the image graph of the key frames, registers and adjusts
 *  them and calibrates the camera, and so improves the poses that later frames are aligned with;
 *  frames that were lost are tried there again.
 *
 *   \code
 *   ScanSession session(camera);
 *   while (camera.grab(frame))
 *     show(session.addFrame(frame), session.cloud());
 *   const ReconstructionResult result = session.finish();
 *   \endcode
 *
 *  All methods are called from one thread. The session keeps all frames, without loss. */
class BUNDLE_ICP_EXPORT ScanSession {
public:
  /** \param camera of all frames, without distortion
   *  \throws pcl::BadArgumentException for invalid options or a camera that no frame can have. */
  explicit ScanSession(const CameraIntrinsics& camera, const ScanSessionOptions& options = {});
  ~ScanSession();

  /** Takes the next frame. Its number is that of the frames before it; the images are copied.
   *  \throws pcl::BadArgumentException for images of wrong type or size, a stamp that is not finite
   *  or not later than that of the frame before, or after finish(). The session then goes on
   *  without the frame. */
  LivePose
  addFrame(const RGBDFrame& frame);

  /** The same of an organized cloud, see toFrame(). \param stamp [s] */
  LivePose
  addFrame(const pcl::PointCloud<pcl::PointXYZRGBA>& cloud, double stamp);

  /** What is registered now. */
  LiveModel
  model() const;

  /** Poses of all frames as they are known now; without those that are lost or doubtful. */
  Trajectory
  trajectory() const;

  /** Coloured points of the key frames' depth, world frame [m]. */
  pcl::PointCloud<pcl::PointXYZRGB>::Ptr
  cloud() const;

  /** The surface of the key frames as they are registered now; without triangles while there are
   *  none. It takes some 20 ms a key frame. */
  pcl::PolygonMesh
  mesh() const;

  /** Views that would close the largest holes of mesh(), which is made for it. See suggestViews().
   *  \throws pcl::BadArgumentException for invalid options. */
  std::vector<NextView>
  suggestions(const NextViewOptions& options = {}) const;

  /** Bytes that the frames take. */
  std::size_t
  storedBytes() const;

  /** All frames as a dataset, which the session owns. */
  const RGBDDataset&
  dataset() const;

  /** Ends the session: what reconstruct() gives for all frames. \throws as reconstruct(), and when
   *  it was called before. */
  ReconstructionResult
  finish(const ProgressCallback& progress = {});

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace bundle_icp
