// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/reconstruction.h>

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/io/mesh_io.h>

#include <algorithm>
#include <utility>

namespace bundle_icp {
namespace {

/** Any less holds no frame. */
constexpr std::size_t LEAST_MEMORY = std::size_t(1) << 20;

constexpr std::pair<ReconstructionMethod, const char*> METHOD_NAMES[] = {
    {ReconstructionMethod::F2M_ICP, "f2m_icp"},
    {ReconstructionMethod::VISUAL_ICP, "visual_icp"},
    {ReconstructionMethod::RGBD_SFM, "rgbd_sfm"},
    {ReconstructionMethod::BUNDLE_ICP, "bundle_icp"}};

/** The first format that writeMesh() does not know, if any. */
std::string
unknownFormat(const std::vector<std::string>& formats)
{
  const std::vector<std::string> known = meshFormats();
  const auto found = std::find_if(formats.begin(), formats.end(), [&](const std::string& format) {
    return std::find(known.begin(), known.end(), format) == known.end();
  });
  return found == formats.end() ? "" : "'" + *found + "'";
}

} // namespace

std::string
toString(ReconstructionMethod method)
{
  for (const auto& [known, name] : METHOD_NAMES)
    if (known == method)
      return name;
  throw BadArgumentException("toString: no such method");
}

std::optional<ReconstructionMethod>
parseReconstructionMethod(const std::string& name)
{
  for (const auto& [method, known] : METHOD_NAMES)
    if (known == name)
      return method;
  return std::nullopt;
}

bool
ReconstructionOptions::isValid(std::string* error) const
{
  std::string reason;
  if (depth_reduction < 1 || depth_reduction > 8)
    reason = "depth_reduction must lie in 1 ... 8";
  else if (num_threads < 0)
    reason = "num_threads must be >= 0";
  else if (max_memory > 0 && max_memory < LEAST_MEMORY)
    reason = "max_memory must be 0 or at least " + std::to_string(LEAST_MEMORY) + " bytes";
  else if (moving == MovingPart::OBJECT && method == ReconstructionMethod::F2M_ICP)
    reason = "moving: f2m_icp cannot track an object before a camera that stands still";
  else if (poses && (method != ReconstructionMethod::BUNDLE_ICP || moving != MovingPart::CAMERA))
    reason = "poses: given poses are of a camera that moves, and need no method";
  else if (next_views && !make_mesh)
    reason = "next_views: without a mesh it is not known where surface is missing";
  else if (make_mesh && mesh_formats.empty())
    reason = "mesh_formats is empty";
  else if (const std::string unknown = unknownFormat(mesh_formats); !unknown.empty())
    reason = "unknown mesh format " + unknown + "; known are ply, obj and stl";
  else
    features.isValid(&reason) && graph.isValid(&reason) && mapper.isValid(&reason) &&
        tracking.isValid(&reason) && volume.isValid(&reason) && mesh.isValid(&reason) &&
        (!object || object->isValid(&reason)) && (!poses || poses->isValid(&reason)) &&
        (!next_views || next_views->isValid(&reason));
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

ReconstructionOptions
ReconstructionOptions::withThreads() const
{
  ReconstructionOptions options = *this;
  options.graph.matching.num_threads = num_threads;
  options.graph.retrieval.num_threads = num_threads;
  options.mapper.num_threads = num_threads;
  options.tracking.num_threads = num_threads;
  options.volume.num_threads = num_threads;
  options.mesh.num_threads = num_threads;
  if (options.next_views)
    options.next_views->num_threads = num_threads;
  return options;
}

} // namespace bundle_icp
