// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/dataset_formats.h"

namespace bundle_icp {

/** An image of the stream of colour images or of that of depth images. */
struct StreamImage {
  std::size_t number = 0; ///< becomes the id of its frame
  double timestamp = 0;   ///< [s]
  std::string file;
};
using Stream = std::vector<StreamImage>;

/** Makes frames of images that were taken within max_difference [s], closest first, and says how
 *  far they are apart.
 *  \throws pcl::IOException when there are none. */
void
pairByTime(const Stream& color, const Stream& depth, double max_difference,
           const std::string& folder, Recording& recording);

/** Makes frames of images whose names differ from those of their stream in the same numbers, or in
 *  the same text. Frames have the order of these.
 *  \throws pcl::IOException when the names do not say which images belong together. */
void
pairByName(const Stream& color, const Stream& depth, const std::string& folder,
           Recording& recording);

/** Whether the names of a stream's images count up in its order, by numbers that are not the
 *  stamps. */
bool
namesRise(const Stream& stream);

/** Whether a file is an image by its name, and no hidden one. */
bool
isImageName(const std::string& name);

/** The files of a folder whose names fit, by default the images, in the order of what differs
 *  between their names.
 *  \throws pcl::IOException when there are none. */
Stream
listFiles(const std::string& folder, bool (*fits)(const std::string& name));
Stream
listImages(const std::string& folder);

/** The names of a stream's images without folder and extension. */
std::vector<std::string>
stemsOf(const Stream& stream);

} // namespace bundle_icp
