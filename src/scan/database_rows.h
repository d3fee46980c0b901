// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "graph/feature_checks.h"

#include <bundle_icp/graph/feature_matching.h>

#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

/** Features and matches as the rows of a scan database. */
namespace bundle_icp {

using Bytes = std::string;

/** COLMAP's descriptors are in units of 1/512, ours in 1/256 and at most 127. */
constexpr double DESCRIPTOR_UNITS = 2;

/** The bytes of an array; files go from machine to machine of one byte order. */
template <class Value>
Bytes
bytesOf(const Value* values, std::size_t count)
{
  return {reinterpret_cast<const char*>(values), count * sizeof(Value)};
}

template <class Value>
Bytes
bytesOf(const std::vector<Value>& values)
{
  return bytesOf(values.data(), values.size());
}

template <class Value>
void
take(const Bytes& bytes, std::vector<Value>& values)
{
  values.resize(bytes.size() / sizeof(Value));
  std::memcpy(static_cast<void*>(values.data()), bytes.data(), values.size() * sizeof(Value));
}

/** Of all that a row holds. */
class Checksum {
public:
  void
  add(const Bytes& bytes)
  {
    const auto size = std::uint64_t(bytes.size()); // else bytes could change columns
    value_ = crc32(value_, reinterpret_cast<const Bytef*>(&size), sizeof(size));
    value_ = crc32(value_, reinterpret_cast<const Bytef*>(bytes.data()), uInt(bytes.size()));
  }

  template <class Number>
  void
  addNumber(Number number)
  {
    add(bytesOf(&number, 1));
  }

  std::int64_t
  value() const
  {
    return std::int64_t(value_);
  }

private:
  uLong value_ = crc32(0, nullptr, 0);
};

/** The columns of bundle_icp_features, and the descriptors. */
struct FeatureRow {
  double sharpness = 0;
  Bytes pixels, pixel_sigmas, depths, depth_sigmas, depth_slopes, colors, descriptors;

  std::int64_t
  checksum() const
  {
    Checksum sum;
    sum.addNumber(sharpness);
    for (const Bytes* const column :
         {&pixels, &pixel_sigmas, &depths, &depth_sigmas, &depth_slopes, &colors, &descriptors})
      sum.add(*column);
    return sum.value();
  }
};

inline FeatureRow
toRow(const Features& features)
{
  cv::Mat descriptors;
  features.descriptors.convertTo(descriptors, CV_8U, DESCRIPTOR_UNITS);
  return {features.sharpness,
          bytesOf(features.pixels),
          bytesOf(features.pixel_sigmas),
          bytesOf(features.depths),
          bytesOf(features.depth_sigmas),
          bytesOf(features.depth_slopes),
          bytesOf(features.colors),
          bytesOf(descriptors.data, descriptors.total())};
}

inline Features
toFeatures(const FeatureRow& row)
{
  Features features;
  features.sharpness = row.sharpness;
  take(row.pixels, features.pixels);
  take(row.pixel_sigmas, features.pixel_sigmas);
  take(row.depths, features.depths);
  take(row.depth_sigmas, features.depth_sigmas);
  take(row.depth_slopes, features.depth_slopes);
  take(row.colors, features.colors);
  cv::Mat(int(features.size()), DESCRIPTOR_SIZE, CV_8UC1, const_cast<char*>(row.descriptors.data()))
      .convertTo(features.descriptors, CV_8U, 1 / DESCRIPTOR_UNITS);
  return features;
}

inline Bytes
toBytes(const Pose& pose)
{
  return bytesOf(pose.matrix().data(), 16);
}

inline Pose
toPose(const Bytes& bytes)
{
  Pose pose;
  if (bytes.size() == 16 * sizeof(double))
    std::memcpy(pose.matrix().data(), bytes.data(), bytes.size());
  return pose;
}

/** The columns of bundle_icp_pairs. */
struct PairRow {
  std::int64_t num_putative = 0;
  Bytes matches, first_from_second, other_matches, other_first_from_second;

  std::int64_t
  checksum(std::int64_t first, std::int64_t second) const
  {
    Checksum sum;
    for (const std::int64_t number : {first, second, num_putative})
      sum.addNumber(number);
    for (const Bytes* const column :
         {&matches, &first_from_second, &other_matches, &other_first_from_second})
      sum.add(*column);
    return sum.value();
  }
};

inline PairRow
toRow(const FramePair& pair)
{
  return {std::int64_t(pair.num_putative), bytesOf(pair.matches), toBytes(pair.first_from_second),
          bytesOf(pair.matches_of_other_motion), toBytes(pair.other_first_from_second)};
}

inline FramePair
toPair(const PairRow& row)
{
  FramePair pair;
  pair.num_putative = std::size_t(row.num_putative);
  take(row.matches, pair.matches);
  pair.first_from_second = toPose(row.first_from_second);
  take(row.other_matches, pair.matches_of_other_motion);
  pair.other_first_from_second = toPose(row.other_first_from_second);
  return pair;
}

/** Of a row of bundle_icp_map. */
inline std::int64_t
checksumOf(std::uint64_t fingerprint, const Bytes& state)
{
  Checksum sum;
  sum.addNumber(fingerprint);
  sum.add(state);
  return sum.value();
}

} // namespace bundle_icp
