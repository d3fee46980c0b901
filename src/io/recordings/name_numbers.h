// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <string>
#include <vector>

namespace bundle_icp {

/** What tells the images of one stream apart: of each name the numbers that differ between the
 *  names (A_hat1_color_frame10: "10"; Redwood's 0000012-000000400000: "12" and "400000"), without
 *  leading zeros. Where the names hold no such numbers, the text between their common beginning
 *  and their common end.
 *  \param stems names of files without folder and extension */
std::vector<std::vector<std::string>>
distinguishingParts(const std::vector<std::string>& stems);

/** Orders what distinguishingParts() gives: numbers by value, other text by letters. */
bool
comesBefore(const std::vector<std::string>& a, const std::vector<std::string>& b);

/** Whether a part is a number, with or without a fraction. */
bool
isNumber(const std::string& part);

/** The value of a part that isNumber(). */
double
numberOf(const std::string& part);

} // namespace bundle_icp
