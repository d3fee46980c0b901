// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "measurement.h"

#include <string>
#include <vector>

namespace bundle_icp {

/** Quantity that varies along a curve. */
enum class Axis { KEEP, BLUR };

/** The conditions that differ in `axis` alone, ascending; empty when there are fewer
 * than two. */
std::vector<ConditionResult>
curve(const ScanResult& scan, Axis axis);

/** "every n-th frame", "blurred images [%]" */
std::string
title(Axis axis);

/** The condition's place on the axis. */
std::string
label(const Condition& condition, Axis axis);

/** The paper's Table 1 for one condition, Markdown. */
std::string
toMarkdown(const ConditionResult& result);

/** All tables, and the curves as tables, Markdown. */
std::string
toMarkdown(const std::vector<ScanResult>& scans, const std::vector<Variant>& variants);

/** The same numbers and more, JSON. */
std::string
toJson(const std::vector<ScanResult>& scans);

} // namespace bundle_icp
