// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <string>
#include <utility>
#include <vector>

namespace bundle_icp {

/** How serious a Finding is. */
enum class Severity {
  NOTE,    ///< worth knowing; the result does not suffer
  WARNING, ///< the result may suffer in part
  FAULT    ///< the result is not to be trusted
};

/** Name of a severity: "note", "warning", "fault". */
BUNDLE_ICP_EXPORT const char*
toString(Severity severity);

/** Something about a recording or a result that its user should know. */
struct Finding {
  Severity severity = Severity::NOTE;
  std::string kind; ///< a short name of what it is about, for programs: "time_stamps", "units", ...
  std::string what; ///< one sentence with the figures that matter
  std::vector<std::pair<std::string, double>> evidence; ///< figures by name, with the unit in it
  std::string remedy; ///< the option or action that mends it; empty when there is none
};

/** Whether a result can be trusted, as its findings say. */
enum class Verdict {
  GOOD,    ///< no finding above NOTE
  USABLE,  ///< warnings, no fault
  DOUBTFUL ///< at least one fault
};

/** Name of a verdict: "good", "usable", "doubtful". */
BUNDLE_ICP_EXPORT const char*
toString(Verdict verdict);

/** The verdict of these findings. */
BUNDLE_ICP_EXPORT Verdict
verdictOf(const std::vector<Finding>& findings);

/** "warning: WHAT; REMEDY". */
BUNDLE_ICP_EXPORT std::string
toString(const Finding& finding);

} // namespace bundle_icp
