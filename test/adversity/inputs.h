// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "recording.h"

#include <functional>
#include <string>
#include <vector>

namespace adversity {

/** One way to spoil a recording, and what is then right. */
struct Input {
  std::string name;
  std::vector<std::string> bases; ///< recordings that are spoiled, each an input of its own
  std::function<void(Recording&)> spoil;
  /** Regular expression of a message that names the cause: then the recording may be refused or its
   *  result be doubtful. Empty: the result must be right. */
  std::string cause;
  double least_share = 0.5; ///< of the colour images that must get a pose
  bool is_fast = false;     ///< its first base is in the fast part
  /** Its error is measured against that of every n-th frame of the base: so many images repeat. */
  std::size_t reference_step = 1;
};

/** Lists, names, pairs and time stamps. */
std::vector<Input>
pairingInputs();
std::vector<Input>
stampInputs();
/** Files and lists that are damaged. */
std::vector<Input>
fileInputs();
/** Colour and depth that do not belong together. */
std::vector<Input>
togetherInputs();
/** Units of depth. */
std::vector<Input>
unitInputs();
/** Intrinsics. */
std::vector<Input>
cameraInputs();
/** What the images show. */
std::vector<Input>
sceneInputs();

} // namespace adversity
