// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/live_map.h"

#include <bundle_icp/reconstruction.h>

#include <condition_variable>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

namespace bundle_icp {

/** Builds the model of a session from its key frames, in a thread of its own: features, matches,
 *  registration by Bundle ICP, tracks, adjustment. Key frames that cannot be registered are tried
 *  again as the model grows. */
class LiveMapper {
public:
  LiveMapper(const CameraIntrinsics& camera, const ReconstructionOptions& options);
  ~LiveMapper();
  LiveMapper(const LiveMapper&) = delete;
  LiveMapper&
  operator=(const LiveMapper&) = delete;

  /** Takes the next key frame. */
  void
  add(NewKeyFrame frame);

  /** Key frames that are not in the map yet. \throws what ended the thread, if anything did */
  std::size_t
  numWaiting() const;

  /** Waits until no key frame waits. */
  void
  wait() const;

  /** The map as it is now. */
  std::shared_ptr<const LiveMap>
  map() const;

private:
  void
  run();

  const CameraIntrinsics camera_;
  const ReconstructionOptions options_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::deque<NewKeyFrame> queue_;
  bool is_busy_ = false; ///< a key frame was taken from the queue
  bool ends_ = false;
  std::exception_ptr failure_;
  std::shared_ptr<const LiveMap> map_ = std::make_shared<LiveMap>();
  std::thread thread_;
};

} // namespace bundle_icp
