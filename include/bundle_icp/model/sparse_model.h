// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/calibration.h>
#include <bundle_icp/common/pose.h>
#include <bundle_icp/graph/image_graph.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace boost {
namespace serialization {
class access;
}
} // namespace boost

namespace bundle_icp {

/** A feature of a frame that shows a point of the model. */
struct Observation {
  std::size_t frame = 0;
  int feature = 0;
};

/** A 3D point with its track: "the list of 2D point sets and their frame indices". */
struct ScenePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero(); ///< [m], world frame
  std::vector<Observation> track;                     ///< empty = removed
};

/** Bounds within which observations join tracks. */
struct BUNDLE_ICP_EXPORT TrackOptions {
  /** Largest distance of a measured point from its track's point [sigma]. */
  double max_sigmas = 4;
  /** Largest distance of a feature's pixel from the track's projected point [px]. */
  double max_pixel_error = 4;

  bool
  isValid(std::string* error = nullptr) const;
};

/** Poses, points and tracks: the one state that a reconstruction changes. Frames have the indices
 *  of the ImageGraph, which functions that need features and matches take as an argument. */
class BUNDLE_ICP_EXPORT SparseModel {
public:
  explicit SparseModel(std::size_t num_frames = 0);

  /** Makes room for frames appended to the graph. */
  void
  resize(std::size_t num_frames);

  std::size_t
  numFrames() const
  {
    return frames_.size();
  }

  bool
  isRegistered(std::size_t frame) const
  {
    return frames_[frame].component >= 0;
  }

  /** Component of a frame, -1 = not registered. Each component has its own world frame. */
  int
  component(std::size_t frame) const
  {
    return frames_[frame].component;
  }

  /** Registered frames of a component in ascending order; -1 = all components. */
  std::vector<std::size_t>
  registeredFrames(int component = -1) const;

  const Pose&
  worldFromCamera(std::size_t frame) const
  {
    return frames_[frame].world_from_camera;
  }

  void
  setWorldFromCamera(std::size_t frame, const Pose& world_from_camera)
  {
    frames_[frame].world_from_camera = world_from_camera;
  }

  /** Difference of the camera from ImageGraph::camera(); all frames share it. */
  const Calibration&
  calibration() const
  {
    return calibration_;
  }

  void
  setCalibration(const Calibration& calibration)
  {
    calibration_ = calibration;
  }

  /** Error that all pixels of a frame's depth share, in units of the camera's depth_noise. */
  const DepthError&
  depthError(std::size_t frame) const
  {
    return frames_[frame].depth_error;
  }

  void
  setDepthError(std::size_t frame, const DepthError& error)
  {
    frames_[frame].depth_error = error;
  }

  /** Motion of the scene in the camera frame while the frame was taken [rad/s, m/s]: after t
   *  seconds a point X of the camera frame lies at increment(t motion) * X. */
  const Vector6d&
  motion(std::size_t frame) const
  {
    return frames_[frame].motion;
  }

  void
  setMotion(std::size_t frame, const Vector6d& motion)
  {
    frames_[frame].motion = motion;
  }

  /** Motion of the camera frame between the times of colour and depth. */
  Pose
  depthFromColor(std::size_t frame) const
  {
    return increment(calibration_[CalibrationParameter::TIME_OFFSET] * frames_[frame].motion);
  }

  /** Pose of the camera when the depth of the frame was taken. */
  Pose
  worldFromDepth(std::size_t frame) const
  {
    return frames_[frame].world_from_camera * depthFromColor(frame).inverse();
  }

  /** Registers a frame; its features join no tracks. */
  void
  registerFrame(std::size_t frame, const Pose& world_from_camera, int component);

  /** Registers a frame and updates the points. Along each edge to a registered frame of the
   *  component, matched features join the neighbour's track, start a track or join two tracks. */
  void
  registerFrame(const ImageGraph& graph, std::size_t frame, const Pose& world_from_camera,
                int component, const TrackOptions& options);

  /** Takes a frame's pose back, and its observations from all points. */
  void
  removeFrame(std::size_t frame);

  /** Builds the tracks of a frame again from its present pose, see registerFrame(). */
  void
  extendTracks(const ImageGraph& graph, std::size_t frame, const TrackOptions& options);

  /** Joins matches of two registered frames to tracks as extendTracks() does; no edge between the
   *  frames is needed. Frames without tracks are ignored. */
  void
  joinMatches(const ImageGraph& graph, std::size_t first, std::size_t second,
              const std::vector<FeatureMatch>& matches, const TrackOptions& options);

  /** Drops the tracks of a component and builds them again for each of its frames that had any. */
  void
  rebuildTracks(const ImageGraph& graph, int component, const TrackOptions& options);

  /** Visibility V of equation (4): the number of the frame's features that match a feature of a
   *  registered frame of the component, where that feature is part of a 3D point. */
  std::size_t
  visibility(const ImageGraph& graph, std::size_t frame, int component) const;

  /** Index of a feature's point, -1 = none. */
  int
  pointOf(std::size_t frame, int feature) const;

  /** Points in order of creation. A point with an empty track has been removed. */
  const std::vector<ScenePoint>&
  points() const
  {
    return points_;
  }

  void
  setPosition(std::size_t point, const Eigen::Vector3d& position)
  {
    points_[point].position = position;
  }

  /** Removes observations that no longer fit their point, and points with fewer than two
   *  observations. \return number of observations removed. */
  std::size_t
  removeOutliers(const ImageGraph& graph, const TrackOptions& options);

  /** Moves a component's world: its poses and points are multiplied by new_from_old. */
  void
  transform(int component, const Pose& new_from_old);

private:
  friend class boost::serialization::access;
  /** Defined where archives are used. */
  template <class Archive>
  void
  serialize(Archive& archive, unsigned version);

  struct Frame {
    Pose world_from_camera = Pose::Identity();
    int component = -1;
    DepthError depth_error = DepthError::Zero();
    Vector6d motion = Vector6d::Zero();
    std::vector<int> points; ///< per feature; empty = none at all

    template <class Archive>
    void
    serialize(Archive& archive, unsigned version);
  };

  void
  joinMatch(const ImageGraph& graph, const Observation& added, const Observation& known,
            const TrackOptions& options);

  void
  addObservation(const ImageGraph& graph, int point, const Observation& observation);

  void
  mergePoints(int into, int from);

  void
  removeObservation(const Observation& observation);

  std::vector<Frame> frames_;
  std::vector<ScenePoint> points_;
  Calibration calibration_;
};

/** Measured point of an observation, corrected by motion and calibration: camera frame [m]. */
BUNDLE_ICP_EXPORT Eigen::Vector3d
measuredPointInCamera(const ImageGraph& graph, const SparseModel& model,
                      const Observation& observation);

/** Measured point of an observation in the world [m]. */
BUNDLE_ICP_EXPORT Eigen::Vector3d
measuredPoint(const ImageGraph& graph, const SparseModel& model, const Observation& observation);

/** True when an observation agrees with `point` (world) within the bounds. */
BUNDLE_ICP_EXPORT bool
agrees(const ImageGraph& graph, const SparseModel& model, const Observation& observation,
       const Eigen::Vector3d& point, const TrackOptions& options);

} // namespace bundle_icp
