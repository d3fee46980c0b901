// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/pairing.h"

namespace bundle_icp {

/** Makes frames of two streams of images of which only the names are known: by time where the
 *  names hold times, else by what differs in them. Sets number and time stamp of each frame, and
 *  says how.
 *  \throws pcl::IOException when the names do not say which images belong together. */
void
pairImages(Stream color, Stream depth, const DatasetOptions& options, const std::string& folder,
           Recording& recording);

/** The same for images whose names hold no times: frame n is that of the number n in the names. It
 *  sets no time that counts, and says nothing of times. */
void
pairNumberedImages(Stream color, Stream depth, const std::string& folder, Recording& recording);

/** Gives each file of one stream its number and its time: that in its name, or else n / 30 s. Says
 *  which. */
void
placeInTime(Stream& files, Recording& recording);

/** Says that the stamps n / 30 s of frames are no times. */
void
sayNoTimes(Recording& recording);

/** Whether the stamps of the frames can be used; where not, says why.
 *  \param source where they come from, for messages */
void
checkStamps(const std::string& source, Recording& recording);

} // namespace bundle_icp
