// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Poses while one scans, from any pcl::Grabber of organized clouds:
//   live_scan            plays a simulated scan
//   live_scan FOLDER     plays a folder of organized PCD files
//   live_scan --openni2  a camera, where PCL was built with OpenNI2
#include <bundle_icp/common/organized_cloud.h>
#include <bundle_icp/scan/scan_session.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <pcl/io/pcd_grabber.h>
#include <pcl/pcl_config.h>

#include <boost/filesystem.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <iomanip>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#if defined(HAVE_OPENNI2) && __has_include(<OpenNI.h>)
#define WITH_OPENNI2
#include <pcl/io/openni2_grabber.h>
#endif
#ifdef WITH_VIEWER
#include <pcl/visualization/pcl_visualizer.h>
#endif

using Cloud = pcl::PointCloud<pcl::PointXYZRGBA>;

namespace {

constexpr float RATE = 15; // of what is played [Hz]

/** A grabber that plays a scan. */
class ScanGrabber : public pcl::Grabber {
public:
  ScanGrabber() : signal_(createSignal<void(const Cloud::ConstPtr&)>()) {}
  ~ScanGrabber() noexcept override { stop(); }

  void
  start() override
  {
    stop();
    is_running_ = true;
    thread_ = std::thread([this] {
      for (std::size_t i = 0; i < scan_.size() && is_running_; ++i)
        (*signal_)(cloud(i));
      is_running_ = false;
    });
  }
  void
  stop() override
  {
    is_running_ = false;
    if (thread_.joinable())
      thread_.join();
  }
  bool
  isRunning() const override
  {
    return is_running_;
  }
  std::string
  getName() const override
  {
    return "ScanGrabber";
  }
  float
  getFramesPerSecond() const override
  {
    return RATE;
  }

private:
  static bundle_icp::SyntheticScanOptions
  scanOptions()
  {
    bundle_icp::SyntheticScanOptions options;
    options.num_frames = 30;
    options.frame_rate = RATE;
    options.width = 320;
    options.height = 240;
    options.focal_length = 262.5;
    return options;
  }
  Cloud::Ptr
  cloud(std::size_t i) const
  {
    const bundle_icp::RGBDFrame frame = scan_.read(i);
    Cloud::Ptr cloud(new Cloud(std::uint32_t(frame.depth.cols), std::uint32_t(frame.depth.rows)));
    cloud->header.stamp = std::uint64_t(1e6 * frame.timestamp) + 1;
    for (int v = 0; v < frame.depth.rows; ++v)
      for (int u = 0; u < frame.depth.cols; ++u) {
        const float z = frame.depth.at<float>(v, u);
        (*cloud)(u, v).getVector3fMap() = scan_.camera().unproject(u, v, z).cast<float>();
        std::copy_n(frame.color.at<cv::Vec3b>(v, u).val, 3, &(*cloud)(u, v).b); // b, g, r
      }
    return cloud;
  }

  const bundle_icp::SyntheticScan scan_{scanOptions()};
  boost::signals2::signal<void(const Cloud::ConstPtr&)>* signal_;
  std::atomic<bool> is_running_{false};
  std::thread thread_;
};

std::unique_ptr<pcl::Grabber>
openGrabber(const std::string& source)
{
  if (source.empty())
    return std::make_unique<ScanGrabber>();
#ifdef WITH_OPENNI2
  if (source == "--openni2")
    return std::make_unique<pcl::io::OpenNI2Grabber>();
#endif
  std::vector<std::string> files;
  for (const auto& entry : boost::filesystem::directory_iterator(source))
    if (entry.path().extension() == ".pcd")
      files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return std::make_unique<pcl::PCDGrabber<pcl::PointXYZRGBA>>(files, RATE);
}

/** A session that clouds come to; its camera is that of the first one. A session is used by one
 *  thread at a time. */
class LiveScan {
public:
  void
  add(const Cloud& cloud)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!session_)
      session_.emplace(bundle_icp::intrinsicsOf(cloud));
    // Files have no stamp.
    const double number = double(frames_++);
    pose_ = session_->addFrame(cloud, cloud.header.stamp ? 1e-6 * double(cloud.header.stamp)
                                                         : number / double(RATE));
  }
  /** One line on what there is now. */
  void
  print() const
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!session_)
      return;
    const bundle_icp::LiveModel model = session_->model();
    std::cout << model.frames << " frames, " << model.key_frames << " key frames, "
              << model.points->size() << " points; now " << toString(pose_.status) << " at "
              << std::fixed << std::setprecision(3)
              << pose_.world_from_camera.translation().transpose() << " m " << pose_.reason << '\n';
  }
  pcl::PointCloud<pcl::PointXYZRGB>::Ptr
  cloud() const
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    return session_ ? session_->cloud() : std::make_shared<pcl::PointCloud<pcl::PointXYZRGB>>();
  }
  void
  finish()
  {
    if (session_)
      std::cout << session_->finish().summary() << '\n';
  }

private:
  mutable std::mutex mutex_;
  std::optional<bundle_icp::ScanSession> session_;
  bundle_icp::LivePose pose_;
  std::size_t frames_ = 0;
};

} // namespace

int
main(int argc, char** argv)
{
  const auto grabber = openGrabber(argc > 1 ? argv[1] : "");
  LiveScan scan;
  const std::function<void(const Cloud::ConstPtr&)> callback =
      [&scan](const Cloud::ConstPtr& cloud) { scan.add(*cloud); };
  grabber->registerCallback(callback);
#ifdef WITH_VIEWER
  pcl::visualization::PCLVisualizer viewer("live scan");
#endif
  grabber->start();
  while (grabber->isRunning()) {
    std::this_thread::sleep_for(std::chrono::seconds(1));
    scan.print();
#ifdef WITH_VIEWER
    if (!viewer.updatePointCloud<pcl::PointXYZRGB>(scan.cloud()))
      viewer.addPointCloud<pcl::PointXYZRGB>(scan.cloud());
    viewer.spinOnce(1);
#endif
  }
  grabber->stop();
  scan.finish();
}
