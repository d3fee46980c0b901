// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/graph/feature_matching.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** What a run has found in the images, on disk (SQLite): a run that was killed, and a run with
 *  other options, takes from there what does not have to be found again.
 *
 *  Cameras, images, keypoints, descriptors and verified matches lie in the tables of COLMAP
 *  (Schoenberger, Frahm, CVPR 2016) and in their form; what these lack, in tables of bundle_icp.
 *  Every row says by a hash what it was made from, and by a checksum that it is whole. No other
 *  class knows SQL.
 *
 *  Several threads may call all methods at once. What is added outlives the process within a second
 *  in which more is added, and after commit(). All methods throw pcl::IOException that names the
 *  file and the reason; after that all throw the same. */
class ScanDatabase {
public:
  using ImageId = std::int64_t;

  /** Opens a file or makes it. No other process can open it meanwhile.
   *  \param fresh forgets what it holds
   *  \throws pcl::IOException when the file is no scan database, of another version, damaged, or in
   *  use; it is not touched then. */
  ScanDatabase(const std::string& path, bool fresh);
  /** Keeps what was added. */
  ~ScanDatabase();

  /** The image of that name, new where there is none. An image whose content differs loses its
   *  features and its pairs.
   *  \param content hash of all that its features are made from */
  ImageId
  image(const std::string& name, std::uint64_t content, const CameraIntrinsics& camera);

  /** Unset when they were not added. */
  std::optional<Features>
  features(ImageId image);

  void
  addFeatures(ImageId image, const Features& features);

  /** What matching two images gave; FramePair::first and second are 0. Unset when they were not
   *  matched.
   *  \param settings hash of the options of matching */
  std::optional<FramePair>
  pair(ImageId first, ImageId second, std::uint64_t settings);

  void
  addPair(ImageId first, ImageId second, std::uint64_t settings, const FramePair& pair,
          const CameraIntrinsics& camera);

  /** Copies the images of another database that this one has none of the same name for, their
   *  features, and their pairs. */
  void
  takeFrom(ScanDatabase& other);

  /** What setMap() kept under that fingerprint; unset when it was of another. */
  std::optional<std::string>
  map(std::uint64_t fingerprint);

  /** In place of any other, at once.
   *  \param fingerprint hash of all that the map depends on */
  void
  setMap(std::uint64_t fingerprint, const std::string& state);

  /** Keeps what was added until now. */
  void
  commit();

private:
  struct StoredImage {
    ImageId id = 0;
    std::string name;
    std::uint64_t content = 0;
    CameraIntrinsics camera; ///< without noise
  };
  struct StoredPair {
    ImageId first = 0, second = 0;
    std::uint64_t settings = 0;
  };
  std::vector<StoredImage>
  images();
  std::vector<StoredPair>
  pairs();

  class Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace bundle_icp
