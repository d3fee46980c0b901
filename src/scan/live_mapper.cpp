// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/live_mapper.h"

#include "scan/live_model.h"

#if defined(__linux__)
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace bundle_icp {
namespace {

/** The thread that gives poses comes first where cores are few. */
void
lowerPriority()
{
#if defined(__linux__) // there, the number of a thread stands for this thread alone
  setpriority(PRIO_PROCESS, id_t(syscall(SYS_gettid)), 10);
#endif
}

} // namespace

LiveMapper::LiveMapper(const CameraIntrinsics& camera, const ReconstructionOptions& options)
: camera_(camera), options_(options), thread_([this] { run(); })
{
}

LiveMapper::~LiveMapper()
{
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void
LiveMapper::run()
{
  lowerPriority();
  try {
    LiveSparseModel model(camera_, options_);
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return ends_ || !queue_.empty(); });
      if (ends_)
        return;
      NewKeyFrame frame = std::move(queue_.front());
      queue_.pop_front();
      is_busy_ = true;
      lock.unlock();
      model.add(std::move(frame));
      std::shared_ptr<const LiveMap> map = model.snapshot();
      lock.lock();
      map_ = std::move(map);
      is_busy_ = false;
      changed_.notify_all();
    }
  }
  catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    failure_ = std::current_exception();
    changed_.notify_all();
  }
}

void
LiveMapper::add(NewKeyFrame frame)
{
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    queue_.push_back(std::move(frame));
  }
  changed_.notify_all();
}

std::size_t
LiveMapper::numWaiting() const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  if (failure_)
    std::rethrow_exception(failure_);
  return queue_.size() + (is_busy_ ? 1 : 0);
}

void
LiveMapper::wait() const
{
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return failure_ || (queue_.empty() && !is_busy_); });
  if (failure_)
    std::rethrow_exception(failure_);
}

std::shared_ptr<const LiveMap>
LiveMapper::map() const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  return map_;
}

} // namespace bundle_icp
