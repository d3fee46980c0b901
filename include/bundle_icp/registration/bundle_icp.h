// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/registration/impl/point_alignment.h>

#include <pcl/point_types.h>
#include <pcl/registration/registration.h>

#include <functional>

namespace bundle_icp {

/** Algorithm 1 of the paper behind PCL's registration interface: registers a new frame against the
 *  virtual depth of the registered frames.
 *
 *   \code
 *   bundle_icp::BundleICP<pcl::PointXYZRGBNormal, pcl::PointXYZRGBNormal> reg;
 *   reg.setCameraIntrinsics(camera);
 *   reg.setInputSource(toPointCloud(makeDepthView(frame.depth, camera)));
 *   reg.setInputTarget(toPointCloud(renderVirtualDepth(views, camera, world_from_virtual)));
 *   reg.setVirtualDepthPose(world_from_virtual);
 *   reg.setVisualCorrespondences(source_points, target_points, weights); // optional
 *   reg.align(aligned, guess);
 *   if (reg.hasConverged())
 *     world_from_camera = reg.getFinalTransformation();
 *   \endcode
 *
 *  Points are associated by projection when both clouds are organized, a camera is set and the
 *  target projects onto its own grid from the virtual pose. Lengths are then metres. Otherwise
 *  points are associated by a kd-tree, and any unit of length serves. Both ways are point-to-plane,
 *  robust and coarse to fine. A target without normals gets normals from its neighbourhoods.
 *
 *  Where projection gives a first answer that much of the source contradicts or does not reach,
 *  ICP starts again from some 200 poses about the guess, and the answer that most agrees is taken;
 *  this takes several times as long. It is not done with visual correspondences, nor with a guess
 *  that is said to be good (setMaxMisalignment()). A pose that cannot be trusted has the status
 *  LOW_OVERLAP.
 *
 *  Inherited setters keep PCL's meaning: the transformation epsilon is a squared length (default
 *  1e-8), the rotation epsilon a cosine (default 0: 1 - transformation epsilon), the Euclidean
 *  fitness epsilon a relative change of the mean squared distance. The default limit is 100
 *  iterations. As in pcl::IterativeClosestPoint, a run that reaches the limit counts as converged
 *  if the clouds meet (BundleICPStatus). The first search in the target builds its kd-tree. */
template <typename PointSource, typename PointTarget, typename Scalar = float>
class BundleICP : public pcl::Registration<PointSource, PointTarget, Scalar> {
  using Base = pcl::Registration<PointSource, PointTarget, Scalar>;

public:
  using Ptr = pcl::shared_ptr<BundleICP>;
  using ConstPtr = pcl::shared_ptr<const BundleICP>;
  using typename Base::Matrix4;
  using typename Base::PointCloudSource;
  using typename Base::PointCloudSourceConstPtr;
  using typename Base::PointCloudTarget;
  using typename Base::PointCloudTargetConstPtr;
  using typename Base::PointCloudTargetPtr;
  using VirtualDepthRenderer = std::function<PointCloudTargetPtr(const Eigen::Isometry3d&)>;

  BundleICP();

  /** Sets the new frame's points: camera frame, metres, NaN = no depth. A null or empty cloud is
   *  refused with PCL_ERROR and leaves no source: the next align() fails. */
  void
  setInputSource(const PointCloudSourceConstPtr& cloud) override;

  /** Sets the target: world frame, metres, NaN = nothing seen. Refuses clouds as above. */
  void
  setInputTarget(const PointCloudTargetConstPtr& cloud) override;

  /** Sets the camera of the source and of the virtual depth.
   *  \throws pcl::BadArgumentException when the intrinsics cannot be those of a camera. */
  void
  setCameraIntrinsics(const CameraIntrinsics& camera);

  /** Unset until setCameraIntrinsics(). */
  const std::optional<CameraIntrinsics>&
  getCameraIntrinsics() const
  {
    return settings_.camera;
  }

  /** Sets the pose from which the target was rendered. The default is identity, right for a target
   *  in its own camera frame. \throws pcl::BadArgumentException for a matrix that is not rigid. */
  void
  setVirtualDepthPose(const Eigen::Isometry3d& world_from_virtual);

  const Eigen::Isometry3d&
  getVirtualDepthPose() const
  {
    return settings_.world_from_virtual;
  }

  /** Sets pairs of matched feature points (Algorithm 1, line 1). align() starts from their robust
   *  least-squares fit, or from its guess when they support no pose. The pairs stay until replaced.
   *  \param source_points in the source camera frame [m]
   *  \param target_points in the world frame [m]
   *  \param weights 1 / sigma^2 of each pair's distance [1/m^2]
   *  \throws pcl::BadArgumentException for lists of different length, values that are not finite or
   *  weights that are not positive. */
  void
  setVisualCorrespondences(const std::vector<Eigen::Vector3d>& source_points,
                           const std::vector<Eigen::Vector3d>& target_points,
                           const std::vector<double>& weights);

  const VisualCorrespondences&
  getVisualCorrespondences() const
  {
    return settings_.visual;
  }

  /** Sets the function that renders the target again when the pose has moved more than 2 cm or 2
   *  degrees since the last rendering. An empty function: the target is never rendered again. */
  void
  setVirtualDepthRenderer(const VirtualDepthRenderer& render);

  const VirtualDepthRenderer&
  getVirtualDepthRenderer() const
  {
    return render_;
  }

  /** Sets the largest distance between the surfaces under the guess of align() [m], default 0.3. A
   *  smaller value is faster: below 0.03 projective association skips its coarse levels. Up to
   *  0.03 the guess decides along motions that the surfaces leave open. A pose from visual
   *  correspondences counts as within 0.03 m. Without a camera the value has no effect.
   *  \throws pcl::BadArgumentException when negative or not finite. */
  void
  setMaxMisalignment(double distance);

  double
  getMaxMisalignment() const
  {
    return settings_.max_misalignment;
  }

  /** Sets the number of threads, 0 = all (default).
   *  \throws pcl::BadArgumentException when negative. */
  void
  setNumberOfThreads(int num_threads);

  int
  getNumberOfThreads() const
  {
    return settings_.num_threads;
  }

  /** Outcome of the last align(). */
  const BundleICPResult&
  getResult() const
  {
    return result_;
  }

protected:
  void
  computeTransformation(PointCloudSource& output, const Matrix4& guess) override;

private:
  class LazyKdTree;

  void
  dropResult();
  AlignmentProblem
  makeProblem();

  AlignmentProblem settings_; ///< camera, virtual pose, visual evidence, noise and threads
  VirtualDepthRenderer render_;
  PointCloudTargetConstPtr rendered_; ///< the last rendered target of the running align()
  BundleICPResult result_;
};

} // namespace bundle_icp

#include <bundle_icp/registration/impl/bundle_icp.hpp>

#if !defined(PCL_NO_PRECOMPILE) && !defined(BUNDLE_ICP_BUNDLE_ICP_CPP_)
extern template class bundle_icp::BundleICP<pcl::PointXYZ, pcl::PointXYZ>;
extern template class bundle_icp::BundleICP<pcl::PointXYZRGB, pcl::PointXYZRGB>;
extern template class bundle_icp::BundleICP<pcl::PointNormal, pcl::PointNormal>;
extern template class bundle_icp::BundleICP<pcl::PointXYZRGBNormal, pcl::PointXYZRGBNormal>;
#endif
