// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <pcl/exceptions.h>

#include <string>

namespace bundle_icp {

/** An exception of PCL whose text is the message alone. PCL puts the place in its sources before
 *  it, and where none is given, a colon. */
template <typename Base>
class PlainException : public Base {
public:
  explicit PlainException(const std::string& message) : Base(message), message_(message) {}

  const char*
  what() const noexcept override
  {
    return message_.c_str();
  }

private:
  std::string message_;
};

/** A file or folder cannot be read or written; the message names it and the reason. */
using IOException = PlainException<pcl::IOException>;
/** An argument or option is impossible; the message names it and what is possible. */
using BadArgumentException = PlainException<pcl::BadArgumentException>;

} // namespace bundle_icp
