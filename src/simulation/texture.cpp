// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/texture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/imgproc.hpp>

namespace bundle_icp {
namespace simulation {

Texture::Texture(const cv::Mat& image)
{
  cv::Mat current, padded;
  cv::cvtColor(image, current, cv::COLOR_BGR2BGRA);
  for (float scale = 1;; scale /= 2) {
    // Halving is exact, and fast, for even sizes.
    cv::copyMakeBorder(current, padded, 0, current.rows % 2, 0, current.cols % 2,
                       cv::BORDER_REPLICATE);
    const auto* texels = padded.ptr<std::uint32_t>();
    levels_.push_back({{texels, texels + padded.total()}, padded.cols, padded.rows, scale});
    if (std::min(padded.cols, padded.rows) < 4)
      break;
    cv::resize(padded, current, padded.size() / 2, 0, 0, cv::INTER_AREA);
  }
}

Eigen::Array4f
Texture::bilinear(const Level& level, const Eigen::Vector2f& uv)
{
  const float u = std::clamp((uv.x() + 0.5f) * level.scale - 0.5f, 0.f, float(level.width - 1));
  const float v = std::clamp((uv.y() + 0.5f) * level.scale - 0.5f, 0.f, float(level.height - 1));
  const int u0 = std::min(int(u), level.width - 2), v0 = std::min(int(v), level.height - 2);
  const float a = u - float(u0), b = v - float(v0);
  const auto* top =
      reinterpret_cast<const uchar*>(level.texels.data() + std::ptrdiff_t(v0) * level.width + u0);
  const uchar* bottom = top + 4 * std::ptrdiff_t(level.width);
  const auto color = [](const uchar* texel) {
    return cv::v_cvt_f32(cv::v_reinterpret_as_s32(cv::v_load_expand_q(texel)));
  };
  const cv::v_float32x4 upper =
      color(top) * cv::v_setall_f32(1 - a) + color(top + 4) * cv::v_setall_f32(a);
  const cv::v_float32x4 lower =
      color(bottom) * cv::v_setall_f32(1 - a) + color(bottom + 4) * cv::v_setall_f32(a);
  Eigen::Array4f result;
  cv::v_store(result.data(), upper * cv::v_setall_f32(1 - b) + lower * cv::v_setall_f32(b));
  return result;
}

Eigen::Array4f
Texture::trilinear(const Eigen::Vector2f& uv, float lod) const
{
  const int last = int(levels_.size()) - 1;
  if (lod <= 0)
    return bilinear(levels_.front(), uv);
  if (lod >= float(last))
    return bilinear(levels_.back(), uv);
  const int fine = int(lod);
  const float weight = lod - float(fine);
  return bilinear(levels_[fine], uv) * (1 - weight) + bilinear(levels_[fine + 1], uv) * weight;
}

Eigen::Array4f
Texture::sample(const Eigen::Vector2f& uv, const Eigen::Vector2f& dx,
                const Eigen::Vector2f& dy) const
{
  constexpr int max_samples = 6;
  // Several samples along the longer edge: a square filter would blur surfaces seen at
  // an angle.
  const bool x_is_long = dx.squaredNorm() > dy.squaredNorm();
  const Eigen::Vector2f& axis = x_is_long ? dx : dy;
  const float length = axis.norm();
  const float area = std::abs(dx.x() * dy.y() - dx.y() * dy.x());
  const float width = std::max(area / std::max(length, 1e-6f), 0.5f);
  const int samples = std::clamp(int(0.7f * length / width + 0.5f), 1, max_samples);
  // Bilinear interpolation blurs by about half a texel itself, hence the finer level.
  const float lod = std::log2(std::max(width, length / float(samples))) - 0.3f;
  Eigen::Array4f sum = Eigen::Array4f::Zero();
  for (int i = 0; i < samples; ++i)
    sum += trilinear(uv + axis * ((float(i) + 0.5f) / float(samples) - 0.5f), lod);
  return sum / float(samples);
}

BoxLayout
layoutBox(const Eigen::Vector3d& extent, double density)
{
  const auto texels = [density](double metres) {
    return std::max(4, int(std::lround(metres * density)));
  };
  const int x = texels(extent.x()), y = texels(extent.y()), z = texels(extent.z());
  BoxLayout layout;
  layout.sides = {cv::Rect(0, 0, y, z),         cv::Rect(y + x, 0, y, z), cv::Rect(y, 0, x, z),
                  cv::Rect(2 * y + x, 0, x, z), cv::Rect(0, z, x, y),     cv::Rect(x, z, x, y)};
  layout.size = {2 * (x + y), z + y};
  return layout;
}

} // namespace simulation
} // namespace bundle_icp
