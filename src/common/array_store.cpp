// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/array_store.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace bundle_icp {
namespace {

/** Part of the file that is mapped at once: a process may have some 65,000 mappings. */
constexpr std::size_t SEGMENT_BYTES = std::size_t(32) << 20;
/** Arrays begin at multiples of this: where one is read, the kernel maps what lies around it in
 *  blocks of so many bytes, and releaseMemory() gives back the array's alone. The gaps take no room
 *  on disk. */
constexpr std::size_t ALIGNMENT = std::size_t(64) << 10;

std::size_t
roundedUp(std::size_t bytes)
{
  return (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
}

[[noreturn]] void
fail(const std::string& folder, int error)
{
  throw IOException(folder + ": what does not fit in memory cannot be kept in this folder: " +
                    std::strerror(error));
}

std::string
temporaryFolder()
{
  boost::system::error_code code;
  const boost::filesystem::path folder = boost::filesystem::temp_directory_path(code);
  return code ? "/tmp" : folder.string(); // one that is missing fails when it is needed
}

/** A new file without a name. */
int
openFile(const std::string& folder)
{
  std::string path = (boost::filesystem::path(folder) / ".bundle_icp.XXXXXX").string();
  const int file = ::mkostemp(path.data(), O_CLOEXEC);
  if (file < 0)
    fail(folder, errno);
  ::unlink(path.c_str());
  return file;
}

void
write(int file, const std::uint8_t* data, std::size_t bytes, std::size_t offset,
      const std::string& folder)
{
  while (bytes > 0) {
    const ssize_t written = ::pwrite(file, data, bytes, off_t(offset));
    if (written < 0 && errno != EINTR)
      fail(folder, errno);
    const std::size_t done = written > 0 ? std::size_t(written) : 0;
    data += done;
    offset += done;
    bytes -= done;
  }
}

} // namespace

/** Maps a part of the file as long as an array in it is used. */
class ArrayStore::Segment {
public:
  Segment(int file, std::size_t offset, std::size_t bytes, const std::string& folder)
  : offset_(offset), bytes_(bytes),
    data_(::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, file, off_t(offset)))
  {
    if (data_ == MAP_FAILED)
      fail(folder, errno);
  }
  ~Segment() { ::munmap(data_, bytes_); }
  Segment(const Segment&) = delete;
  Segment&
  operator=(const Segment&) = delete;

  std::size_t
  offset() const
  {
    return offset_;
  }

  std::size_t
  bytes() const
  {
    return bytes_;
  }

  std::uint8_t*
  data() const
  {
    return static_cast<std::uint8_t*>(data_);
  }

private:
  const std::size_t offset_, bytes_;
  void* const data_;
};

struct ArrayStore::Place {
  std::shared_ptr<const Segment> segment;
  std::size_t offset; ///< in the segment
};

namespace {

/** Ties arrays to the segments in which their data lie. */
class SegmentAllocator : public cv::MatAllocator {
public:
  cv::UMatData*
  allocate(int dims, const int* sizes, int type, void* data, std::size_t* step,
           cv::AccessFlag flags, cv::UMatUsageFlags usage) const override
  {
    return cv::Mat::getStdAllocator()->allocate(dims, sizes, type, data, step, flags, usage);
  }

  bool
  allocate(cv::UMatData* data, cv::AccessFlag flags, cv::UMatUsageFlags usage) const override
  {
    return cv::Mat::getStdAllocator()->allocate(data, flags, usage);
  }

  void
  deallocate(cv::UMatData* data) const override
  {
    delete static_cast<std::shared_ptr<const void>*>(data->userdata);
    delete data;
  }
};

const SegmentAllocator&
segmentAllocator()
{
  static const auto* const allocator = new SegmentAllocator; // outlives all arrays
  return *allocator;
}

/** An array like another, with data that `owner` keeps. */
cv::Mat
arrayAt(std::uint8_t* data, const cv::Mat& like, const std::shared_ptr<const void>& owner)
{
  cv::Mat array(like.size(), like.type(), data);
  auto counted = std::make_unique<cv::UMatData>(&segmentAllocator());
  counted->data = counted->origdata = data;
  counted->size = like.total() * like.elemSize();
  counted->refcount = 1;
  counted->userdata = new std::shared_ptr<const void>(owner);
  array.u = counted.release();
  return array;
}

} // namespace

ArrayStore::ArrayStore(std::size_t max_bytes, std::string folder)
: max_bytes_(max_bytes), folder_(folder.empty() ? temporaryFolder() : std::move(folder))
{
}

ArrayStore::~ArrayStore()
{
  if (file_ >= 0)
    ::close(file_); // what is mapped stays until it is unmapped
}

ArrayStore::Place
ArrayStore::reserve(std::size_t bytes)
{
  if (file_ < 0)
    file_ = openFile(folder_);
  if (!segment_ || used_ + bytes > segment_->bytes()) {
    const std::size_t segment_bytes = std::max(SEGMENT_BYTES, roundedUp(bytes));
    segment_ = std::make_shared<const Segment>(file_, file_size_, segment_bytes, folder_);
    file_size_ += segment_bytes;
    used_ = 0;
  }
  return {segment_, std::exchange(used_, used_ + roundedUp(bytes))};
}

cv::Mat
ArrayStore::keep(const cv::Mat& array)
{
  const std::size_t bytes = array.total() * array.elemSize();
  Place place;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (bytes_in_memory_ + bytes <= max_bytes_) {
      bytes_in_memory_ += bytes;
      return array;
    }
    place = reserve(bytes);
    bytes_in_file_ += bytes;
  }
  const cv::Mat dense = array.isContinuous() ? array : array.clone();
  write(file_, dense.data, bytes, place.segment->offset() + place.offset, folder_);
  return arrayAt(place.segment->data() + place.offset, dense, place.segment);
}

void
releaseMemory(const cv::Mat& array)
{
  if (array.u && array.u->currAllocator == &segmentAllocator())
    ::madvise(array.u->origdata, array.u->size, MADV_DONTNEED);
}

} // namespace bundle_icp
