// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/concatenate.h"

#include "common/parallel.h"
#include "volume/block_allocation.h"
#include "volume/depth_filter.h"
#include "volume/tsdf_volume_impl.h"
#include "volume/visible_blocks.h"
#include "volume/voxel_fusion.h"
#include "volume/voxel_sampler.h"

#include <bundle_icp/common/exceptions.h>

#include <cmath>

namespace bundle_icp {
namespace {

template <typename... Parts>
[[noreturn]] void
refuse(const Parts&... parts)
{
  throw BadArgumentException(concatenate("TSDFVolume: ", parts...));
}

void
checkImage(const char* name, const cv::Mat& image, int type, const char* wanted,
           const CameraIntrinsics& camera)
{
  if (image.type() != type)
    refuse(name, " image must be ", wanted);
  if (image.cols != camera.width || image.rows != camera.height)
    refuse(name, " image is ", image.cols, "x", image.rows, ", the camera's images are ",
           camera.width, "x", camera.height);
}

void
checkFrame(const RGBDFrame& frame, const CameraIntrinsics& camera)
{
  std::string error;
  if (!camera.isValid(&error))
    refuse(error);
  if (camera.hasDistortion())
    refuse("the camera has distortion; frames must be undistorted");
  constexpr int smallest = 16; // what slopes over several pixels need
  if (camera.width < smallest || camera.height < smallest)
    refuse("images of ", camera.width, "x", camera.height, " are smaller than ", smallest, "x",
           smallest);
  checkImage("depth", frame.depth, CV_32FC1, "CV_32FC1 in metres", camera);
  if (!frame.color.empty())
    checkImage("color", frame.color, CV_8UC3, "CV_8UC3", camera);
}

void
checkPose(const Pose& world_from_camera, const TSDFOptions& options)
{
  if (!isRigid(world_from_camera.matrix()))
    refuse("world_from_camera is not a rigid motion");
  const double reach = options.voxel_size * BLOCK_EDGE * (VoxelBlockMap::limit - 2) -
                       2 * (options.max_depth + options.truncation);
  const double distance = world_from_camera.translation().cwiseAbs().maxCoeff();
  if (distance > reach)
    refuse("the camera is ", distance, " m from the origin, at most ", reach,
           " m can be addressed");
}

// To (u, v, 1) times depth.
Eigen::Affine3d
imageFromWorld(const CameraIntrinsics& camera, const Pose& camera_from_world)
{
  Eigen::Affine3d camera_matrix = Eigen::Affine3d::Identity();
  camera_matrix.linear() << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  return camera_matrix * camera_from_world;
}

// Different for every block and frame, the same whatever the order of the blocks.
std::uint32_t
roundingSeed(const Eigen::Vector3i& block, std::uint32_t frame)
{
  const std::uint64_t mixed =
      (VoxelBlockMap::key(block) + frame * 0x9e3779b97f4a7c15u) * 0xbf58476d1ce4e5b9u;
  return std::uint32_t(mixed >> 32);
}

/** The voxels of a volume that lie in its region. */
class RegionTest {
public:
  explicit RegionTest(const TSDFOptions& options)
  {
    if (!options.region)
      return;
    region_from_world_ = options.region->world_from_box.inverse();
    half_ = 0.5 * options.region->size;
    voxels_ = region_from_world_.linear() * options.voxel_size;
    extent_ = voxels_.cwiseAbs() * Eigen::Vector3d::Constant(0.5 * (BLOCK_EDGE - 1));
    is_limited_ = true;
  }

  /** For the block whose first voxel lies at `corner` of the world; nothing when all of it
   *  lies inside. */
  std::optional<RegionClip>
  clip(const Eigen::Vector3d& corner) const
  {
    if (!is_limited_)
      return {};
    const Eigen::Vector3d first = region_from_world_ * corner;
    const Eigen::Vector3d center =
        first + voxels_ * Eigen::Vector3d::Constant(0.5 * (BLOCK_EDGE - 1));
    if (((center.cwiseAbs() + extent_).array() <= half_.array()).all())
      return {};
    RegionClip clip;
    for (int i = 0; i < 3; ++i) {
      clip.corner[i] = float(first[i]);
      clip.half[i] = float(half_[i]);
      for (int axis = 0; axis < 3; ++axis)
        clip.step[axis][i] = float(voxels_(i, axis));
    }
    return clip;
  }

private:
  bool is_limited_ = false;
  Pose region_from_world_ = Pose::Identity();
  Eigen::Vector3d half_, extent_;
  Eigen::Matrix3d voxels_; ///< region frame: one voxel along x, y, z of the world
};

} // namespace

bool
ColorCorrection::isValid(std::string* error) const
{
  std::string reason;
  if (!(gain.minCoeff() >= 0.05f && gain.maxCoeff() <= 20 && gain.allFinite()))
    reason = "gain must lie in 0.05 ... 20";
  else if (!(weight > 0 && weight <= 1))
    reason = concatenate("weight ", weight, "; expected above 0 to 1");
  if (error && !reason.empty())
    *error = "ColorCorrection: " + reason;
  return reason.empty();
}

bool
TSDFOptions::isValid(std::string* error) const
{
  const auto fail = [error](const std::string& reason) {
    if (error)
      *error = "TSDFOptions: " + reason;
    return false;
  };
  if (!(voxel_size >= 1e-4 && voxel_size <= 1))
    return fail(concatenate("voxel_size ", voxel_size, " m; expected 0.0001 to 1"));
  if (!(truncation >= 2 * voxel_size && truncation <= 100 * voxel_size))
    return fail(concatenate("truncation ", truncation, " m; expected 2 to 100 voxels of ",
                            voxel_size, " m"));
  if (!(min_depth > 0 && min_depth < max_depth && max_depth <= 1000))
    return fail(concatenate("depth range ", min_depth, " to ", max_depth,
                            " m; expected 0 < min_depth < max_depth <= 1000"));
  std::string reason;
  if (region && !region->isValid(&reason))
    return fail(reason);
  if (smoothing_radius < 0 || smoothing_radius > 10)
    return fail(concatenate("smoothing_radius ", smoothing_radius, " px; expected 0 to 10"));
  if (num_threads < 0)
    return fail(concatenate("num_threads ", num_threads, "; expected 0 (all) or more"));
  return true;
}

TSDFVolume::TSDFVolume(const TSDFOptions& options) : impl_(std::make_unique<Impl>())
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException(error);
  impl_->options = options;
}

TSDFVolume::~TSDFVolume() = default;
TSDFVolume::TSDFVolume(TSDFVolume&&) noexcept = default;
TSDFVolume&
TSDFVolume::operator=(TSDFVolume&&) noexcept = default;

void
TSDFVolume::integrate(const RGBDFrame& frame, const CameraIntrinsics& camera,
                      const Pose& world_from_camera, const ColorCorrection& correction)
{
  const TSDFOptions& options = impl_->options;
  if (std::string error; !correction.isValid(&error))
    throw BadArgumentException(error);
  checkFrame(frame, camera);
  checkPose(world_from_camera, options);
  const int num_threads = resolveThreads(options.num_threads);
  VoxelBlockMap& blocks = impl_->blocks;

  RGBDFrame smooth = frame;
  if (options.smoothing_radius > 0)
    smooth.depth =
        smoothDepth(frame.depth, camera.depth_noise, options.smoothing_radius, num_threads);
  if (impl_->unit_sigma == 0)
    impl_->unit_sigma = camera.depth_noise.sigma(1);
  const DepthSamples samples(smooth, camera, options, impl_->unit_sigma, num_threads);
  for (const std::uint64_t key : findBandBlocks(samples, world_from_camera, options, num_threads))
    blocks.insert(key);
  const Pose camera_from_world = world_from_camera.inverse();
  const std::vector<VisibleBlock> visible =
      findVisibleBlocks(blocks, samples, camera_from_world, options, num_threads);

  const Eigen::Affine3d image_from_world = imageFromWorld(camera, camera_from_world);
  const FusionView view = makeFusionView(samples, image_from_world.linear(), options, correction);
  const RegionTest region(options);
  const double block_size = options.voxel_size * BLOCK_EDGE;
  const std::uint32_t frame_number = impl_->num_frames++;
#pragma omp parallel for schedule(dynamic, 16) num_threads(num_threads)
  for (std::size_t i = 0; i < visible.size(); ++i) {
    const std::uint32_t block = visible[i].number;
    const Eigen::Vector3i coordinates = blocks.coordinatesOf(block);
    const Eigen::Vector3d corner = coordinates.cast<double>() * block_size;
    const Eigen::Vector3f in_image = (image_from_world * corner).cast<float>();
    const std::optional<RegionClip> clip = region.clip(corner);
    if (fuseBlock(view, in_image.data(), visible[i].farthest, clip ? &*clip : nullptr,
                  roundingSeed(coordinates, frame_number), blocks[block]))
      blocks.setMayHoldSurface(block);
  }
}

const TSDFOptions&
TSDFVolume::options() const
{
  return impl_->options;
}

std::size_t
TSDFVolume::numBlocks() const
{
  return impl_->blocks.size();
}

std::size_t
TSDFVolume::memoryBytes() const
{
  return impl_->blocks.memoryBytes();
}

std::optional<float>
TSDFVolume::distance(const Eigen::Vector3f& point) const
{
  const Eigen::Vector3d position = point.cast<double>() / impl_->options.voxel_size;
  // Written so that NaN fails, too.
  if (!(position.cwiseAbs().maxCoeff() < BLOCK_EDGE * (VoxelBlockMap::limit - 2.0)))
    return {};
  const Eigen::Vector3i cell = position.array().floor().cast<int>();
  const Eigen::Vector3f within = (position - cell.cast<double>()).cast<float>();
  const std::optional<float> distance = VoxelSampler(*impl_).distance(cell, within);
  if (!distance)
    return {};
  return *distance * float(impl_->options.truncation);
}

} // namespace bundle_icp
