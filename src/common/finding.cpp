// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/finding.h>
#include <bundle_icp/common/printable_text.h>

namespace bundle_icp {

const char*
toString(Severity severity)
{
  return severity == Severity::NOTE ? "note" : severity == Severity::WARNING ? "warning" : "fault";
}

const char*
toString(Verdict verdict)
{
  return verdict == Verdict::GOOD ? "good" : verdict == Verdict::USABLE ? "usable" : "doubtful";
}

Verdict
verdictOf(const std::vector<Finding>& findings)
{
  Verdict verdict = Verdict::GOOD;
  for (const Finding& finding : findings)
    if (finding.severity == Severity::FAULT)
      verdict = Verdict::DOUBTFUL;
    else if (finding.severity == Severity::WARNING && verdict == Verdict::GOOD)
      verdict = Verdict::USABLE;
  return verdict;
}

std::string
toString(const Finding& finding)
{
  return toString(finding.severity) + (": " + printable(finding.what)) +
         (finding.remedy.empty() ? "" : "; " + finding.remedy);
}

} // namespace bundle_icp
