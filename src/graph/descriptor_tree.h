// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "graph/descriptor_products.h"

#include <memory>
#include <vector>

namespace bundle_icp {

/** A kd-tree over descriptors (pcl::search::FlannSearch), the same in every run. */
class DescriptorTree {
public:
  explicit DescriptorTree(const cv::Mat& descriptors);
  ~DescriptorTree();

  /** For each row of `queries` the two most similar descriptors, approximately. */
  std::vector<BestProducts>
  bestProducts(const cv::Mat& queries) const;

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace bundle_icp
