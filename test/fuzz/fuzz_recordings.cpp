// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Readers of recordings. The first byte of the input chooses a layout; the rest, cut at bytes of
// 0x1e, gives the text files of that layout. Its images are good.
#include "reader.h"

#include <bundle_icp/io/rgbd_dataset.h>

#include <opencv2/imgcodecs.hpp>

#include <vector>

namespace {

/** Files of a layout of recordings. */
struct Layout {
  std::string name;
  std::vector<std::string> color, depth, texts;
};

const std::vector<Layout> LAYOUTS = {
    {"tum",
     {"rgb/1.5.png"},
     {"depth/1.5.png"},
     {"rgb.txt", "depth.txt", "intrinsics.txt", "groundtruth.txt"}},
    {"one_list", {"rgb/1.5.png"}, {"depth/1.5.png"}, {"associations.txt", "intrinsics.txt"}},
    {"seven_scenes",
     {"frame-000000.color.png"},
     {"frame-000000.depth.png"},
     {"frame-000000.pose.txt", "camera-intrinsics.txt"}},
    {"info", {"frame-000000.color.png"}, {"frame-000000.depth.png"}, {"_info.txt"}},
    {"open3d", {"color/0.png"}, {"depth/0.png"}, {"intrinsic.json"}},
    {"yaml", {"color/0.png"}, {"depth/0.png"}, {"calibration.yaml"}},
    {"scannet",
     {"color/0.png"},
     {"depth/0.png"},
     {"intrinsic/intrinsic_color.txt", "intrinsic/intrinsic_depth.txt", "pose/0.txt"}},
    {"stray", {"rgb/000000.png"}, {"depth/000000.png"}, {"camera_matrix.csv", "odometry.csv"}},
    {"nerfstudio", {"images/0.png"}, {"depth/0.png"}, {"transforms.json"}},
    {"polycam",
     {"keyframes/images/0.png"},
     {"keyframes/depth/0.png"},
     {"keyframes/cameras/0.json"}},
    {"sens", {}, {}, {"scan.sens"}},
    {"pcd", {}, {}, {"0.pcd"}},
};

/** Makes the folders and images of all layouts, once. */
void
makeImages()
{
  const cv::Mat color(24, 32, CV_8UC3, cv::Scalar(10, 200, 90));
  const cv::Mat depth(24, 32, CV_16UC1, cv::Scalar(1500));
  for (const Layout& layout : LAYOUTS) {
    const std::string folder = fuzz::folder() + "/" + layout.name + "/";
    for (const auto* files : {&layout.color, &layout.depth, &layout.texts})
      for (const std::string& file : *files)
        boost::filesystem::create_directories(boost::filesystem::path(folder + file).parent_path());
    for (const std::string& file : layout.color)
      cv::imwrite(folder + file, color);
    for (const std::string& file : layout.depth)
      cv::imwrite(folder + file, depth);
  }
}

} // namespace

extern "C" int
LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  static const bool is_made = (makeImages(), true);
  if (size == 0 || !is_made)
    return 0;
  const Layout& layout = LAYOUTS[data[0] % LAYOUTS.size()];
  const std::string folder = fuzz::folder() + "/" + layout.name;
  std::string rest(reinterpret_cast<const char*>(data) + 1, size - 1);
  for (const std::string& file : layout.texts) {
    const std::size_t end = &file == &layout.texts.back() ? std::string::npos : rest.find('\x1e');
    fuzz::write(folder + "/" + file, rest.substr(0, end));
    rest = end == std::string::npos ? "" : rest.substr(end + 1);
  }
  fuzz::read([&] {
    const auto dataset = bundle_icp::openDataset(folder);
    dataset->groundTruth();
    for (std::size_t i = 0; i < std::min<std::size_t>(2, dataset->size()); ++i)
      fuzz::read([&] { dataset->read(i); });
  });
  return 0;
}
