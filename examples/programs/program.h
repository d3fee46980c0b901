// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Shared by the programs: exit codes, one-line errors, progress on the error stream.
#pragma once

#include <bundle_icp/common/printable_text.h>
#include <bundle_icp/common/progress.h>
#include <bundle_icp/version.h>

#include <boost/program_options/errors.hpp>
#include <pcl/console/print.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <iostream>
#if defined(__GLIBC__)
#include <malloc.h>
#endif
#include <new>
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

/** Occupies the descriptors of standard streams that are closed: a file of results that got one
 *  would also get what is printed. */
inline void
holdStandardStreams()
{
  for (int stream = 0; stream <= 2; ++stream)
    if (fcntl(stream, F_GETFD) < 0)
      (void)!open("/dev/null", O_RDONLY);
}

/** Asks a run to stop on SIGINT or SIGTERM, so that it can say what was done and leave nothing
 *  behind. The second signal ends the program at once. */
class StopOnSignal {
public:
  StopOnSignal()
  {
    struct sigaction action {};
    action.sa_handler = [](int) { is_asked_ = 1; };
    action.sa_flags = SA_RESETHAND;
    for (const int signal : {SIGINT, SIGTERM}) {
      struct sigaction earlier {};
      sigaction(signal, nullptr, &earlier);
      if (earlier.sa_handler != SIG_IGN)
        sigaction(signal, &action, nullptr);
    }
  }

  static bool
  isAsked()
  {
    return is_asked_ != 0;
  }

private:
  static inline volatile std::sig_atomic_t is_asked_ = 0;
};

/** Runs a program's body, which returns the exit code, unless the version is asked for. An
 *  exception becomes one line on the error stream and exit code 2 for wrong usage, 1 for everything
 *  else.
 *  \param memory_hint what needs less memory, for the message when there is not enough */
template <typename Body>
int
runProgram(const char* name, const Body& body, int argc, char** argv, const char* memory_hint = "")
{
  // PCL's readers and writers print several lines about a bad file; a program prints
  // one.
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  keepFreedMemory();
  const auto fail = [name](const std::exception& error, int exit_code) {
    // PCL puts a colon before the text of an exception without a place.
    const std::string message = printable(error.what());
    std::fprintf(stderr, "%s: %s%s\n", name,
                 message.c_str() + (message.rfind(": ", 0) == 0 ? 2 : 0),
                 exit_code == 2 ? " (-h for help)" : "");
    return exit_code;
  };
  holdStandardStreams();
  try {
    const bool is_version = std::any_of(
        argv + 1, argv + argc, [](const char* word) { return !std::strcmp(word, "--version"); });
    if (is_version)
      std::cout << name << " " << BUNDLE_ICP_VERSION << "\n";
    const int exit_code = is_version ? 0 : body(argc, argv);
    if (!std::cout.flush() || std::fflush(stdout) != 0)
      throw std::runtime_error("standard output cannot be written: it is closed or full");
    return exit_code;
  }
  catch (const boost::program_options::error& error) {
    return fail(error, 2);
  }
  catch (const UsageError& error) {
    return fail(error, 2);
  }
  catch (const std::bad_alloc&) {
    return fail(std::runtime_error(std::string("not enough memory") + memory_hint), 1);
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

  /** \return false when a signal asked to stop. */
  bool
  operator()(const Progress& progress)
  {
    if (!is_quiet_)
      show(progress);
    return !StopOnSignal::isAsked();
  }

private:
  static constexpr int bar_width = 40;

  void
  show(const Progress& progress)
  {
    if (progress.stage != stage_) {
      finishBar();
      stage_ = progress.stage;
      shown_ = -1;
    }
    const int resolution = is_terminal_ ? bar_width : 10;
    const int part = progress.total > 0 ? int(resolution * progress.done / progress.total) : 0;
    if (part == shown_)
      return;
    shown_ = part;
    is_terminal_ ? drawBar(progress, part) : printLine(progress);
  }

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
