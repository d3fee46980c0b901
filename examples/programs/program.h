// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Shared by the programs: exit codes, one-line errors, progress on the error stream.
#pragma once

#include <bundle_icp/common/progress.h>

#include <boost/program_options/errors.hpp>
#include <pcl/console/print.h>

#include <cstdio>
#if defined(__GLIBC__)
#include <malloc.h>
#endif
#include <stdexcept>
#include <string>
#include <unistd.h>

namespace bundle_icp {

/** Wrong arguments: exit code 2. */
class UsageError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/** Keeps freed memory in the process. Thousands of images come and go: fresh memory from the system
 *  for each image would take a fifth of the time of feature extraction. */
inline void
keepFreedMemory()
{
#if defined(__GLIBC__)
  mallopt(M_MMAP_THRESHOLD, 32 << 20); // bytes
  mallopt(M_TRIM_THRESHOLD, 64 << 20);
#endif
}

/** Runs a program's body, which returns the exit code. An exception becomes one line on the error
 *  stream and exit code 2 for wrong usage, 1 for everything else. */
template <typename Body>
int
runProgram(const char* name, Body&& body)
{
  // PCL's readers and writers print several lines about a bad file; a program prints
  // one.
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  keepFreedMemory();
  const auto fail = [name](const std::exception& error, int exit_code) {
    // PCL puts a colon before the text of an exception without a place.
    const std::string message = error.what();
    std::fprintf(stderr, "%s: %s%s\n", name,
                 message.c_str() + (message.rfind(": ", 0) == 0 ? 2 : 0),
                 exit_code == 2 ? " (-h for help)" : "");
    return exit_code;
  };
  try {
    return body();
  }
  catch (const boost::program_options::error& error) {
    return fail(error, 2);
  }
  catch (const UsageError& error) {
    return fail(error, 2);
  }
  catch (const std::exception& error) {
    return fail(error, 1);
  }
}

/** Shows progress on the error stream: a bar on a terminal, otherwise a plain line for each tenth
 *  of a stage. std::ref makes it a ProgressCallback. */
class ProgressPrinter {
public:
  explicit ProgressPrinter(bool is_quiet = false) : is_quiet_(is_quiet) {}

  ~ProgressPrinter() { finishBar(); }
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter&
  operator=(const ProgressPrinter&) = delete;

  /** Never asks to stop. */
  bool
  operator()(const Progress& progress)
  {
    if (is_quiet_)
      return true;
    if (progress.stage != stage_) {
      finishBar();
      stage_ = progress.stage;
      shown_ = -1;
    }
    const int resolution = is_terminal_ ? bar_width : 10;
    const int part = progress.total > 0 ? int(resolution * progress.done / progress.total) : 0;
    if (part == shown_)
      return true;
    shown_ = part;
    is_terminal_ ? drawBar(progress, part) : printLine(progress);
    return true;
  }

private:
  static constexpr int bar_width = 40;

  void
  drawBar(const Progress& progress, int part)
  {
    std::fprintf(stderr, "\r%-20s [%-*s] %zu/%zu ", stage_.c_str(), bar_width,
                 std::string(std::size_t(part), '#').c_str(), progress.done, progress.total);
    std::fflush(stderr);
    is_bar_open_ = true;
  }

  void
  printLine(const Progress& progress) const
  {
    if (progress.total > 0)
      std::fprintf(stderr, "%s %zu/%zu\n", stage_.c_str(), progress.done, progress.total);
    else
      std::fprintf(stderr, "%s\n", stage_.c_str());
  }

  void
  finishBar()
  {
    if (is_bar_open_)
      std::fputc('\n', stderr);
    is_bar_open_ = false;
  }

  bool is_quiet_;
  bool is_terminal_ = isatty(fileno(stderr)) != 0;
  bool is_bar_open_ = false;
  std::string stage_;
  int shown_ = -1; ///< part of the stage that was printed last
};

} // namespace bundle_icp
