// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/registration/bundle_icp.h>

#include <bundle_icp/common/exceptions.h>

#include <pcl/common/transforms.h>
#include <pcl/search/impl/search.hpp>
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <cmath>
#include <mutex>

namespace bundle_icp {

/** A kd-tree that the first search builds: projective association needs no kd-tree, but
 *  getFitnessScore() does. A point that is not finite has no neighbours. */
template <typename PointSource, typename PointTarget, typename Scalar>
class BundleICP<PointSource, PointTarget, Scalar>::LazyKdTree
: public pcl::search::KdTree<PointTarget> {
  using Tree = pcl::search::KdTree<PointTarget>;

public:
  void
  setInputCloud(const PointCloudTargetConstPtr& cloud,
                const pcl::IndicesConstPtr& indices = {}) override
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    this->input_ = cloud;
    this->indices_ = indices;
    built_ = false;
  }

  int
  nearestKSearch(const PointTarget& point, int k, pcl::Indices& indices,
                 std::vector<float>& squared_distances) const override
  {
    // What getFitnessScore() reads even when nothing was found: beyond any range.
    indices.assign(std::size_t(k), 0);
    squared_distances.assign(std::size_t(k), std::numeric_limits<float>::infinity());
    if (!pcl::isFinite(point) || !build())
      return 0;
    return Tree::nearestKSearch(point, k, indices, squared_distances);
  }

  int
  radiusSearch(const PointTarget& point, double radius, pcl::Indices& indices,
               std::vector<float>& squared_distances, unsigned int max_nn = 0) const override
  {
    indices.clear();
    squared_distances.clear();
    if (!pcl::isFinite(point) || !build())
      return 0;
    return Tree::radiusSearch(point, radius, indices, squared_distances, max_nn);
  }

private:
  bool
  build() const
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!built_ && this->input_) {
      has_points_ = std::any_of(this->input_->begin(), this->input_->end(),
                                [](const PointTarget& p) { return pcl::isFinite(p); });
      if (has_points_)
        this->tree_->setInputCloud(this->input_, this->indices_);
      built_ = true;
    }
    return built_ && has_points_;
  }

  mutable std::mutex mutex_;
  mutable bool built_ = false, has_points_ = false;
};

namespace detail {

/** Moves a cloud and, if it has them, its normals; `in` and `out` may be the same cloud. */
template <typename PointT, typename Scalar>
void
transformPoints(const pcl::PointCloud<PointT>& in, pcl::PointCloud<PointT>& out,
                const Eigen::Matrix<Scalar, 4, 4>& matrix)
{
  if constexpr (pcl::traits::has_normal<PointT>::value)
    pcl::transformPointCloudWithNormals(in, out, matrix);
  else
    pcl::transformPointCloud(in, out, matrix);
}

} // namespace detail

template <typename PointSource, typename PointTarget, typename Scalar>
BundleICP<PointSource, PointTarget, Scalar>::BundleICP()
{
  this->reg_name_ = "BundleICP";
  this->max_iterations_ = settings_.max_iterations;
  this->transformation_epsilon_ = settings_.translation_epsilon;
  this->tree_.reset(new LazyKdTree);
}

template <typename PointSource, typename PointTarget, typename Scalar>
void
BundleICP<PointSource, PointTarget, Scalar>::dropResult()
{
  this->converged_ = false;
  this->nr_iterations_ = 0;
  result_ = BundleICPResult();
}

template <typename PointSource, typename PointTarget, typename Scalar>
void
BundleICP<PointSource, PointTarget, Scalar>::setInputSource(const PointCloudSourceConstPtr& cloud)
{
  dropResult();
  if (cloud && !cloud->empty()) {
    Base::setInputSource(cloud);
    return;
  }
  PCL_ERROR("[bundle_icp::%s::setInputSource] The cloud is null or empty\n",
            this->getClassName().c_str());
  this->input_.reset();
  this->final_transformation_.setIdentity();
}

template <typename PointSource, typename PointTarget, typename Scalar>
void
BundleICP<PointSource, PointTarget, Scalar>::setInputTarget(const PointCloudTargetConstPtr& cloud)
{
  dropResult();
  if (cloud && !cloud->empty()) {
    Base::setInputTarget(cloud);
    return;
  }
  PCL_ERROR("[bundle_icp::%s::setInputTarget] The cloud is null or empty\n",
            this->getClassName().c_str());
  this->target_.reset();
  this->final_transformation_.setIdentity();
}

template <typename PointSource, typename PointTarget, typename Scalar>
void
BundleICP<PointSource, PointTarget, Scalar>::setCameraIntrinsics(const CameraIntrinsics& camera)
{
  std::string error;
  if (!camera.isValid(&error))
    throw BadArgumentException("BundleICP::setCameraIntrinsics: " + error);
  settings_.camera = camera;
}

template <typename PointSource, typename PointTarget, typename Scalar>
void
BundleICP<PointSource, PointTarget, Scalar>::setVirtualDepthPose(
    const Eigen::Isometry3d& world_from_virtual)
{
  if (!isRigid(world_from_virtual.matrix()))
    throw BadArgumentException("BundleICP::setVirtualDepthPose: the matrix is not a rigid motion");
  settings_.world_from_virtual = closestPose(world_from_virtual.matrix());
}

template <typename PointSource, typename PointTarget, typename Scalar>
void
BundleICP<PointSource, PointTarget, Scalar>::setVisualCorrespondences(
    const std::vector<Eigen::Vector3d>& source_points,
    const std::vector<Eigen::Vector3d>& target_points, const std::vector<double>& weights)
{
  const VisualCorrespondences visual{source_points, target_points, weights};
  std::string error;
  if (!isValid(visual, &error))
    throw BadArgumentException("BundleICP::setVisualCorrespondences: " + error);
  settings_.visual = visual;
}

template <typename PointSource, typename PointTarget, typename Scalar>
void
BundleICP<PointSource, PointTarget, Scalar>::setVirtualDepthRenderer(
    const VirtualDepthRenderer& render)
{
  render_ = render;
}

template <typename PointSource, typename PointTarget, typename Scalar>
void
BundleICP<PointSource, PointTarget, Scalar>::setMaxMisalignment(double distance)
{
  if (!(distance >= 0 && std::isfinite(distance)))
    throw BadArgumentException("BundleICP::setMaxMisalignment: " + std::to_string(distance) +
                               " m; expected a finite distance of 0 or more");
  settings_.max_misalignment = distance;
}

template <typename PointSource, typename PointTarget, typename Scalar>
void
BundleICP<PointSource, PointTarget, Scalar>::setNumberOfThreads(int num_threads)
{
  if (num_threads < 0)
    throw BadArgumentException("BundleICP::setNumberOfThreads: " + std::to_string(num_threads) +
                               " must be at least 0");
  settings_.num_threads = num_threads;
}

template <typename PointSource, typename PointTarget, typename Scalar>
AlignmentProblem
BundleICP<PointSource, PointTarget, Scalar>::makeProblem()
{
  AlignmentProblem problem = settings_;
  problem.source = viewPoints(*this->input_);
  problem.target = viewPoints(*this->target_);
  problem.source_indices = this->indices_.get();
  problem.max_iterations = this->max_iterations_;
  problem.max_distance = this->corr_dist_threshold_;
  problem.translation_epsilon = this->transformation_epsilon_;
  problem.rotation_epsilon = this->transformation_rotation_epsilon_ > 0
                                 ? this->transformation_rotation_epsilon_
                                 : 1 - this->transformation_epsilon_;
  problem.fitness_epsilon = this->euclidean_fitness_epsilon_;
  problem.nearest = [this](const float* xyz, int k, std::vector<int>& indices) {
    PointTarget query;
    query.x = xyz[0];
    query.y = xyz[1];
    query.z = xyz[2];
    thread_local std::vector<float> squared_distances;
    indices.resize(std::size_t(
        std::max(0, this->tree_->nearestKSearch(query, k, indices, squared_distances))));
  };
  if (render_)
    problem.render = [this](const Pose& pose) -> std::optional<PointsView> {
      const PointCloudTargetConstPtr cloud = render_(pose);
      if (!cloud || cloud->empty())
        return std::nullopt;
      rendered_ = cloud;
      return viewPoints(*rendered_);
    };
  return problem;
}

template <typename PointSource, typename PointTarget, typename Scalar>
void
BundleICP<PointSource, PointTarget, Scalar>::computeTransformation(PointCloudSource& output,
                                                                   const Matrix4& guess)
{
  dropResult();
  rendered_ = this->target_;
  const Eigen::Matrix4d start = guess.template cast<double>();
  if (!isRigid(start)) {
    PCL_ERROR("[bundle_icp::%s::align] The guess is not a rigid motion\n",
              this->getClassName().c_str());
    result_.status = BundleICPStatus::INVALID_INPUT;
    return;
  }
  AlignmentProblem problem = makeProblem();
  if (this->update_visualizer_)
    problem.on_iteration = [&](const Pose& pose, const std::vector<int>& source,
                               const std::vector<int>& target) {
      PointCloudSource moved;
      detail::transformPoints(*this->input_, moved, Matrix4(pose.matrix().template cast<Scalar>()));
      this->update_visualizer_(moved, source, *rendered_, target);
    };
  // Algorithm 1, line 2: T*_new, the guess where the correspondences support no pose
  const std::optional<RigidAlignment> visual = estimateVisualPose(problem.visual);
  if (visual)
    problem.visual_scale = visual->scale;
  else
    problem.visual = {};
  result_ = alignPoints(problem, visual ? visual->target_from_source : closestPose(start));
  this->nr_iterations_ = result_.iterations;
  this->converged_ = bundle_icp::hasConverged(result_.status);
  this->final_transformation_ = result_.world_from_source.matrix().template cast<Scalar>();
  this->transformation_ = result_.last_step.matrix().template cast<Scalar>();
  this->previous_transformation_ =
      (result_.last_step.inverse() * result_.world_from_source).matrix().template cast<Scalar>();
  detail::transformPoints(output, output, this->final_transformation_);
}

} // namespace bundle_icp

#define PCL_INSTANTIATE_BundleICP(T) template class BUNDLE_ICP_EXPORT bundle_icp::BundleICP<T, T>;
