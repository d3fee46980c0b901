// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Archives of Boost.Serialization in memory, for machines of one kind. A struct is taken apart by a
// structured binding, so that a field which is forgotten does not compile.
#pragma once

#include <bundle_icp/common/calibration.h>
#include <bundle_icp/common/pose.h>

#include <boost/archive/binary_iarchive.hpp>
#include <boost/archive/binary_oarchive.hpp>
#include <boost/serialization/split_free.hpp>
#include <boost/serialization/string.hpp>
#include <boost/serialization/vector.hpp>

#include <optional>
#include <sstream>
#include <string>

namespace bundle_icp {

template <class Archive, class... Values>
void
archiveAll(Archive& archive, Values&... values)
{
  (archive & ... & values);
}

} // namespace bundle_icp

/** Archives a struct of bundle_icp, all fields of which follow in their order; to be used in the
 *  namespace boost::serialization. */
#define BUNDLE_ICP_ARCHIVE(Struct, ...)                                                            \
  template <class Archive>                                                                         \
  void serialize(Archive& archive, bundle_icp::Struct& value, unsigned)                            \
  {                                                                                                \
    auto& [__VA_ARGS__] = value;                                                                   \
    bundle_icp::archiveAll(archive, __VA_ARGS__);                                                  \
  }

namespace boost {
namespace serialization {

/** Of fixed size. */
template <class Archive, class Scalar, int ROWS, int COLS>
void
serialize(Archive& archive, Eigen::Matrix<Scalar, ROWS, COLS>& matrix, unsigned)
{
  for (Eigen::Index i = 0; i < matrix.size(); ++i)
    archive& matrix.data()[i];
}

template <class Archive>
void
serialize(Archive& archive, bundle_icp::Pose& pose, unsigned)
{
  archive& pose.matrix();
}

template <class Archive, class Value>
void
save(Archive& archive, const std::optional<Value>& value, unsigned)
{
  const bool is_set = value.has_value();
  archive& is_set;
  if (is_set)
    archive&* value;
}

template <class Archive, class Value>
void
load(Archive& archive, std::optional<Value>& value, unsigned)
{
  bool is_set = false;
  archive& is_set;
  value.reset();
  if (is_set)
    archive& value.emplace();
}

template <class Archive, class Value>
void
serialize(Archive& archive, std::optional<Value>& value, unsigned version)
{
  split_free(archive, value, version);
}

BUNDLE_ICP_ARCHIVE(Calibration, values, deviations, depth_scale, depth_scale_origin)

} // namespace serialization
} // namespace boost

namespace bundle_icp {

/** The bytes of some values, one after the other. */
template <class... Values>
std::string
toArchive(const Values&... values)
{
  std::ostringstream stream;
  boost::archive::binary_oarchive archive(stream, boost::archive::no_header);
  archiveAll(archive, values...);
  return stream.str();
}

/** The values of toArchive().
 *  \throws boost::archive::archive_exception when there are fewer */
template <class... Values>
void
fromArchive(const std::string& bytes, Values&... values)
{
  std::istringstream stream(bytes);
  boost::archive::binary_iarchive archive(stream, boost::archive::no_header);
  archiveAll(archive, values...);
}

} // namespace bundle_icp
