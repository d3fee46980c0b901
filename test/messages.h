// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <gtest/gtest.h>

#include <exception>
#include <string>

/** What the exception of a type says that `call` throws; empty, and a failure, without
 * one. */
template <typename Exception, typename Call>
std::string
messageOf(Call&& call)
{
  try {
    call();
  }
  catch (const Exception& error) {
    return error.what();
  }
  catch (const std::exception& error) {
    ADD_FAILURE() << "another exception: " << error.what();
    return "";
  }
  ADD_FAILURE() << "no exception";
  return "";
}

/** Asserts that a text holds another. */
#define EXPECT_CONTAINS(text, part)                                                                \
  EXPECT_NE(std::string(text).find(part), std::string::npos)                                       \
      << "'" << (part) << "' is not in: " << (text)
