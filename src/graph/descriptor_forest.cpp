// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "graph/descriptor_forest.h"

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
using Search = pcl::search::FlannSearch<Descriptor>;

constexpr int TREES = 4;
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

Cloud::Ptr
toCloud(const cv::Mat& descriptors)
{
  Cloud::Ptr cloud(new Cloud);
  cloud->resize(descriptors.rows);
  for (int i = 0; i < descriptors.rows; ++i)
    std::copy_n(descriptors.ptr<std::uint8_t>(i),
                PackedDescriptors::LENGTH,
                (*cloud)[i].histogram);
  return cloud;
}

} // namespace

struct DescriptorForest::Impl {
  Search search{true, Search::FlannIndexCreatorPtr(new Search::KdTreeMultiIndexCreator(TREES))};
  int size = 0;
};

DescriptorForest::DescriptorForest(const cv::Mat& descriptors) : impl_(new Impl)
{
  impl_->size = descriptors.rows;
  if (descriptors.rows == 0)
    return;
  impl_->search.setPointRepresentation(
      pcl::PointRepresentation<Descriptor>::ConstPtr(new HistogramRepresentation));
  impl_->search.setChecks(CHECKS);
  impl_->search.setInputCloud(toCloud(descriptors));
}

DescriptorForest::~DescriptorForest() = default;

std::vector<BestProducts>
DescriptorForest::bestProducts(const cv::Mat& queries) const
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
