// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "graph/descriptor_tree.h"

#include <Eigen/Core>
#include <flann/algorithms/kdtree_index.h>
#include <pcl/point_representation.h>
#include <pcl/point_types.h>
#include <pcl/search/flann_search.h>
#include <pcl/search/impl/flann_search.hpp>
#include <pcl/search/impl/search.hpp>

#include <algorithm>

namespace bundle_icp {
namespace {

using Descriptor = pcl::Histogram<PackedDescriptors::LENGTH>;
using Cloud = pcl::PointCloud<Descriptor>;

/** Leaves that a query visits: more leaves find more matches, in proportionally more time. */
constexpr int CHECKS = 64;
constexpr std::int32_t SQUARED_NORM = 256 * 256;

/** Histograms are compared by all their values, as they are. */
class HistogramRepresentation : public pcl::PointRepresentation<Descriptor> {
public:
  HistogramRepresentation() { nr_dimensions_ = PackedDescriptors::LENGTH; }

  void
  copyToFloatArray(const Descriptor& point, float* out) const override
  {
    std::copy(point.histogram, point.histogram + PackedDescriptors::LENGTH, out);
  }
};

/** FLANN's L2, in vector instructions; sums of integers, so exact in any order. */
struct SquaredDistance {
  using is_kdtree_distance = bool;
  using ElementType = float;
  using ResultType = float;

  float
  operator()(const float* a, const float* b, std::size_t, float = -1) const
  {
    using Vector = Eigen::Map<const Eigen::Matrix<float, PackedDescriptors::LENGTH, 1>>;
    return (Vector(a) - Vector(b)).squaredNorm();
  }

  float
  accum_dist(float a, float b, int) const
  {
    return (a - b) * (a - b);
  }
};

using Search = pcl::search::FlannSearch<Descriptor, SquaredDistance>;

/** A tree that grows from its first row. To build one, FLANN draws from the system's entropy and
 *  from rand(), which all threads share; to add rows to it, it draws nothing. */
class GrownTree : public flann::KDTreeIndex<SquaredDistance> {
public:
  explicit GrownTree(const flann::Matrix<float>& rows)
  : KDTreeIndex({rows.ptr(), 1, rows.cols}, flann::KDTreeIndexParams(1)),
    others_(rows[1], rows.rows - 1, rows.cols)
  {
  }

  void
  buildIndex() override
  {
    KDTreeIndex::buildIndex();
    addPoints(others_, 0); // 0: never built anew
  }

private:
  const flann::Matrix<float> others_;
};

class GrownTreeCreator : public Search::FlannIndexCreator {
public:
  Search::IndexPtr
  createIndex(Search::MatrixConstPtr rows) override
  {
    return Search::IndexPtr(new GrownTree(*rows));
  }
};

Cloud::Ptr
toCloud(const cv::Mat& descriptors)
{
  Cloud::Ptr cloud(new Cloud);
  cloud->resize(descriptors.rows);
  for (int i = 0; i < descriptors.rows; ++i)
    std::copy_n(descriptors.ptr<std::uint8_t>(i), PackedDescriptors::LENGTH, (*cloud)[i].histogram);
  return cloud;
}

} // namespace

struct DescriptorTree::Impl {
  Search search{true, Search::FlannIndexCreatorPtr(new GrownTreeCreator)};
  int size = 0;
};

DescriptorTree::DescriptorTree(const cv::Mat& descriptors) : impl_(new Impl)
{
  impl_->size = descriptors.rows;
  if (descriptors.rows < 2)
    return;
  impl_->search.setPointRepresentation(
      pcl::PointRepresentation<Descriptor>::ConstPtr(new HistogramRepresentation));
  impl_->search.setChecks(CHECKS);
  impl_->search.setInputCloud(toCloud(descriptors));
}

DescriptorTree::~DescriptorTree() = default;

std::vector<BestProducts>
DescriptorTree::bestProducts(const cv::Mat& queries) const
{
  std::vector<BestProducts> result(queries.rows);
  if (impl_->size < 2)
    return result;
  const Cloud::Ptr cloud = toCloud(queries);
  pcl::Indices indices;
  std::vector<float> squared_distances;
  for (int i = 0; i < queries.rows; ++i) {
    if (impl_->search.nearestKSearch((*cloud)[i], 2, indices, squared_distances) < 2)
      continue;
    result[i].index = indices[0];
    result[i].best = SQUARED_NORM - std::int32_t(squared_distances[0] / 2);
    result[i].second = SQUARED_NORM - std::int32_t(squared_distances[1] / 2);
  }
  return result;
}

} // namespace bundle_icp
