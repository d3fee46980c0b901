// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "common/array_store.h"

#include <bundle_icp/common/calibration.h>
#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <limits>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

namespace bundle_icp {

/** Reduced depth images of all frames, in memory as far as they have room, beyond that in a
 *  temporary file. A view's normals and weights, four times as large, are computed on demand; the
 *  views used last are kept. */
class DepthViewStore {
public:
  static constexpr std::size_t NO_LIMIT = std::numeric_limits<std::size_t>::max();

  /** \param max_bytes largest memory of the images and views that are kept, at least that of a few
   *  views
   *  \param folder of the temporary file, see ArrayStore */
  DepthViewStore(const CameraIntrinsics& camera, int reduction, const VirtualDepthOptions& options,
                 std::size_t max_bytes, const std::string& folder);

  /** Makes room for views 0 ... count - 1. */
  void
  resize(std::size_t count);

  /** Frees all views. */
  void
  clear();

  /** Reduces a depth image and keeps it as view `index`. Several threads may set different indices
   *  at once.
   *  \throws pcl::IOException when the temporary file cannot be written. */
  void
  set(std::size_t index, const cv::Mat& depth);

  /** The corrected view; several threads may call this. */
  std::shared_ptr<const DepthView>
  get(std::size_t index, const Calibration& calibration, const DepthError& error);

  /** Memory of the images and views that are kept. */
  std::size_t
  bytesInMemory();

private:
  CameraIntrinsics camera_;
  int reduction_;
  VirtualDepthOptions options_;
  const std::size_t view_bytes_, capacity_; ///< of a view; number of views that are kept
  ArrayStore store_;
  std::vector<cv::Mat> depths_;
  std::mutex mutex_;
  std::list<std::size_t> recent_; ///< front = used last
  struct CachedView {
    std::shared_ptr<const DepthView> view;
    CalibrationVector calibration;
    DepthError error;
    std::list<std::size_t>::iterator recent;
  };
  std::map<std::size_t, CachedView> views_;
};

} // namespace bundle_icp
