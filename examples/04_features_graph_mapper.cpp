// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// The steps of the paper by hand: features, image graph, incremental mapping.
#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/mapping/incremental_mapper.h>

#include <exception>
#include <iostream>

namespace {

void
reconstruct(const std::string& scan)
{
  const auto dataset = bundle_icp::openDataset(scan);
  const bundle_icp::CameraIntrinsics& camera = dataset->camera();

  // Section 2.1: features with measured depth, and the graph of images that share them
  std::vector<bundle_icp::ImageNode> nodes;
  std::vector<std::shared_ptr<const bundle_icp::DepthView>> views;
  for (std::size_t i = 0; i < dataset->size(); ++i) {
    const bundle_icp::RGBDFrame frame = dataset->read(i);
    nodes.push_back({bundle_icp::extractFeatures(frame, camera), frame.timestamp});
    views.push_back(std::make_shared<const bundle_icp::DepthView>(
        bundle_icp::makeDepthView(frame.depth, camera, 2)));
  }
  bundle_icp::ImageGraph graph(camera);
  graph.append(std::move(nodes), dataset->isOrdered());
  std::cout << graph.size() << " images, " << graph.numEdges() << " edges\n";

  // Section 2.2: next frame by visibility, Bundle ICP, points, adjustment
  bundle_icp::MapperOptions options;
  options.refinement.self_calibration = false; // would ask for depth corrected by its findings
  bundle_icp::IncrementalMapper mapper(
      graph, [&views](std::size_t frame, const bundle_icp::SparseModel&) { return views[frame]; },
      options);
  bundle_icp::SparseModel model;
  mapper.run(model);
  for (std::size_t i = 0; i < graph.size(); ++i)
    if (model.isRegistered(i))
      std::cout << dataset->name(i) << ": " << model.worldFromCamera(i).translation().transpose()
                << "\n";
    else
      std::cout << dataset->name(i) << ": " << mapper.registrations()[i].reason << "\n";
}

} // namespace

int
main(int argc, char** argv)
{
  if (argc != 2) {
    std::cerr << "Usage: " << argv[0] << " SCAN\n";
    return 2;
  }
  try {
    reconstruct(argv[1]);
  }
  catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
