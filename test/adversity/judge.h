// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "inputs.h"

#include <optional>
#include <string>

namespace adversity {

/** What the program made of a recording. */
struct Outcome {
  int exit_code = -1;
  std::string verdict;         ///< of report.json; empty when there is none
  std::string messages;        ///< when refused: all it says; else findings above note
  std::size_t num_poses = 0;   ///< in the largest world
  std::optional<double> error; ///< ATE against the true positions [m]; unset below three poses
};

enum class Judgement {
  RIGHT,        ///< within twice the error of the reference, and trusted
  NAMED,        ///< refused or doubtful, and the true cause is named
  MISSED,       ///< refused, doubtful or incomplete without the true cause
  SILENT_FAULT, ///< wrong, but good or usable
  CRASHED       ///< by a signal, or an exit code that stands for something else
};

const char*
toString(Judgement judgement);

/** Runs bundle_icp_reconstruct on the recording in a folder, which changes nothing there.
 *  \param arguments of the program, beyond the usual
 *  \param limits text of the shell before the command, see runProgram() */
Outcome
reconstruct(const std::string& folder, const std::string& output, const Places& places,
            const std::vector<std::string>& arguments, const std::string& limits = "");

/** Largest error that is right, by that of the reference [m]: twice as much, and what does not
 *  matter in a room. */
double
largestError(double reference);

/** \param num_colors colour images of the recording */
Judgement
judge(const Input& input, const Outcome& outcome, std::size_t num_colors, double largest_error);

} // namespace adversity
