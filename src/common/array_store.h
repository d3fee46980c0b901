// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <string>

namespace bundle_icp {

/** Keeps arrays in memory up to a number of bytes, and those beyond it in a temporary file without
 *  a name: the file is gone with the process, however that ends. There is no file as long as all
 *  fits in memory. Several threads may call all methods at once. */
class ArrayStore {
public:
  /** \param folder of the file; empty = the system's for temporary files. One that lies in memory
   *  (tmpfs) saves none. */
  explicit ArrayStore(std::size_t max_bytes, std::string folder = "");
  ~ArrayStore();

  /** The array itself, or one of the same content that is read from the file whenever it is used,
   *  and is not to be written to. Either may outlive the store. The file is mapped: a disk that
   *  fails to read it ends the process with a signal.
   *  \throws pcl::IOException that names the folder and the reason. */
  cv::Mat
  keep(const cv::Mat& array);

  /** Of the arrays that were kept in memory. */
  std::size_t
  bytesInMemory() const
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    return bytes_in_memory_;
  }

  /** Of the arrays in the file. */
  std::size_t
  bytesInFile() const
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    return bytes_in_file_;
  }

private:
  class Segment;
  struct Place;

  Place
  reserve(std::size_t bytes);

  const std::size_t max_bytes_;
  const std::string folder_;
  mutable std::mutex mutex_;
  std::size_t bytes_in_memory_ = 0, bytes_in_file_ = 0;
  int file_ = -1;
  std::shared_ptr<const Segment> segment_; ///< that takes the next array
  std::size_t file_size_ = 0, used_ = 0;   ///< of all segments; of the last one [bytes]
};

/** Gives back the memory that an array in the file of an ArrayStore took when it was read: the next
 *  use reads the file. Does nothing with other arrays. Other threads may use the array
 *  meanwhile. */
void
releaseMemory(const cv::Mat& array);

} // namespace bundle_icp
