// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/scan_database.h"

#include "scan/colmap_rows.h"
#include "scan/database_tables.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>

#include <chrono>
#include <map>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

namespace bundle_icp {
namespace {

/** No more work than this is lost with the process. */
constexpr std::chrono::seconds LONGEST_TRANSACTION{1};

} // namespace

class ScanDatabase::Impl {
public:
  explicit Impl(const std::string& path) : connection(path) { prepareTables(connection); }

  ~Impl()
  {
    try {
      commit();
    }
    catch (const pcl::IOException&) { // what is not on the disk is found again
    }
  }

  /** One call at a time. With a failure SQLite takes the transaction back, so that rows which were
   *  thought written are not there: after it all calls fail. */
  template <class Body>
  auto
  use(const Body& body)
  {
    const std::lock_guard<std::mutex> lock(mutex);
    if (!failure.empty())
      throw IOException(failure);
    try {
      return body();
    }
    catch (const pcl::IOException& error) {
      failure = error.what();
      is_writing = false;
      connection.rollBack();
      throw;
    }
  }

  /** Writes come together: they are faster so. */
  void
  begin()
  {
    if (!is_writing) {
      connection.execute("BEGIN IMMEDIATE");
      is_writing = true;
      began = std::chrono::steady_clock::now();
    }
  }

  void
  commitSometimes()
  {
    if (std::chrono::steady_clock::now() - began > LONGEST_TRANSACTION)
      commit();
  }

  void
  commit()
  {
    if (is_writing) {
      connection.execute("COMMIT");
      is_writing = false;
    }
  }

  ImageId
  addImage(const std::string& name, std::uint64_t content, const CameraIntrinsics& camera);
  std::int64_t
  cameraId(const CameraIntrinsics& camera);
  void
  addColmapPair(ImageId first, ImageId second, const FramePair& pair,
                const CameraIntrinsics& camera);

  std::mutex mutex;
  std::string failure; ///< of an earlier call; empty = none
  Connection connection;
  bool is_writing = false;
  std::chrono::steady_clock::time_point began;
};

std::int64_t
ScanDatabase::Impl::cameraId(const CameraIntrinsics& camera)
{
  const Eigen::Matrix3d k = colmapMatrix(camera);
  const Bytes params = bytesOf(std::vector<double>{k(0, 0), k(1, 1), k(0, 2), k(1, 2)});
  const std::int64_t width = camera.width, height = camera.height;
  Query known(connection,
              "SELECT camera_id FROM cameras WHERE width = ? AND height = ? AND params = ?", width,
              height, params);
  if (known.next())
    return known.integer(0);
  run(connection, "INSERT INTO cameras VALUES (NULL, ?, ?, ?, ?, 1)", std::int64_t(PINHOLE), width,
      height, params);
  return connection.lastInserted();
}

ScanDatabase::ImageId
ScanDatabase::Impl::addImage(const std::string& name, std::uint64_t content,
                             const CameraIntrinsics& camera)
{
  run(connection, "DELETE FROM images WHERE name = CAST(? AS TEXT)", name);
  run(connection, "INSERT INTO images (name, camera_id) VALUES (CAST(? AS TEXT), ?)", name,
      cameraId(camera));
  const ImageId image = connection.lastInserted();
  run(connection, "INSERT INTO bundle_icp_features (image_id, content) VALUES (?, ?)", image,
      std::int64_t(content));
  return image;
}

void
ScanDatabase::Impl::addColmapPair(ImageId first, ImageId second, const FramePair& pair,
                                  const CameraIntrinsics& camera)
{
  const bool is_swapped = second < first;
  const std::int64_t id = pairId(first, second), count = std::int64_t(pair.matches.size());
  const Bytes matches = colmapMatches(pair.matches, is_swapped);
  run(connection, "INSERT OR REPLACE INTO matches VALUES (?, ?, 2, ?)", id, count, matches);

  // Of the camera of the image with the higher number from that with the lower one.
  const Pose pose = is_swapped ? pair.first_from_second : pair.first_from_second.inverse();
  const Eigen::Vector3d t = pose.translation();
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  const Eigen::Matrix3d essential = cross * pose.linear();
  const Eigen::Matrix3d k = colmapMatrix(camera).inverse();
  const Eigen::Quaterniond q(pose.linear());
  run(connection,
      "INSERT OR REPLACE INTO two_view_geometries VALUES (?, ?, 2, ?, ?, ?, ?, ?, ?, ?)", id, count,
      matches, std::int64_t(CALIBRATED), rowMajor(k.transpose() * essential * k),
      rowMajor(essential), rowMajor(Eigen::Matrix3d::Zero()),
      bytesOf(std::vector<double>{q.w(), q.x(), q.y(), q.z()}), bytesOf(t.data(), 3));
}

ScanDatabase::ScanDatabase(const std::string& path, bool fresh)
{
  namespace fs = boost::filesystem;
  if (fs::exists(path) && !fs::is_regular_file(path))
    throw IOException(path + ": is not a regular file");
  impl_ = std::make_unique<Impl>(path);
  if (fresh) {
    impl_->begin();
    impl_->connection.execute(
        "DELETE FROM images; DELETE FROM cameras; DELETE FROM bundle_icp_map");
    impl_->commit();
  }
}

ScanDatabase::~ScanDatabase() = default;

ScanDatabase::ImageId
ScanDatabase::image(const std::string& name, std::uint64_t content, const CameraIntrinsics& camera)
{
  return impl_->use([&] {
    {
      Query known(impl_->connection,
                  "SELECT image_id, content FROM images JOIN bundle_icp_features USING (image_id) "
                  "WHERE name = CAST(? AS TEXT)",
                  name);
      if (known.next() && known.integer(1) == std::int64_t(content))
        return known.integer(0);
    }
    impl_->begin();
    return impl_->addImage(name, content, camera);
  });
}

std::optional<Features>
ScanDatabase::features(ImageId image)
{
  return impl_->use([&]() -> std::optional<Features> {
    Query query(impl_->connection,
                "SELECT sharpness, pixels, pixel_sigmas, depths, depth_sigmas, depth_slopes, "
                "colors, data, checksum, cols FROM bundle_icp_features JOIN descriptors "
                "USING (image_id) WHERE image_id = ?",
                image);
    if (!query.next())
      return std::nullopt;
    const FeatureRow row{query.real(0),  query.bytes(1), query.bytes(2), query.bytes(3),
                         query.bytes(4), query.bytes(5), query.bytes(6), query.bytes(7)};
    if (query.integer(9) != DESCRIPTOR_SIZE || row.checksum() != query.integer(8))
      impl_->connection.failDamaged();
    return toFeatures(row);
  });
}

void
ScanDatabase::addFeatures(ImageId image, const Features& features)
{
  const FeatureRow row = toRow(features);
  std::vector<Eigen::Vector2f> keypoints = features.pixels;
  for (Eigen::Vector2f& keypoint : keypoints)
    keypoint.array() += PIXEL_CENTRE;
  const auto count = std::int64_t(features.size());
  impl_->use([&] {
    impl_->begin();
    run(impl_->connection, "INSERT OR REPLACE INTO keypoints VALUES (?, ?, 2, ?)", image, count,
        bytesOf(keypoints));
    run(impl_->connection, "INSERT OR REPLACE INTO descriptors VALUES (?, ?, ?, ?)", image, count,
        std::int64_t(DESCRIPTOR_SIZE), row.descriptors);
    run(impl_->connection,
        "UPDATE bundle_icp_features SET sharpness = ?, pixels = ?, pixel_sigmas = ?, depths = ?, "
        "depth_sigmas = ?, depth_slopes = ?, colors = ?, checksum = ? WHERE image_id = ?",
        row.sharpness, row.pixels, row.pixel_sigmas, row.depths, row.depth_sigmas, row.depth_slopes,
        row.colors, row.checksum(), image);
    impl_->commitSometimes();
  });
}

std::optional<FramePair>
ScanDatabase::pair(ImageId first, ImageId second, std::uint64_t settings)
{
  return impl_->use([&]() -> std::optional<FramePair> {
    Query query(impl_->connection,
                "SELECT num_putative, matches, first_from_second, other_matches, "
                "other_first_from_second, checksum FROM bundle_icp_pairs "
                "WHERE pair_id = ? AND first = ? AND settings = ?",
                pairId(first, second), first, std::int64_t(settings));
    if (!query.next())
      return std::nullopt;
    const PairRow row{query.integer(0), query.bytes(1), query.bytes(2), query.bytes(3),
                      query.bytes(4)};
    if (row.checksum(first, second) != query.integer(5))
      impl_->connection.failDamaged();
    return toPair(row);
  });
}

void
ScanDatabase::addPair(ImageId first, ImageId second, std::uint64_t settings, const FramePair& pair,
                      const CameraIntrinsics& camera)
{
  const PairRow row = toRow(pair);
  impl_->use([&] {
    impl_->begin();
    run(impl_->connection, "DELETE FROM bundle_icp_pairs WHERE pair_id = ?", pairId(first, second));
    run(impl_->connection, "INSERT INTO bundle_icp_pairs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        pairId(first, second), first, second, std::int64_t(settings), row.num_putative, row.matches,
        row.first_from_second, row.other_matches, row.other_first_from_second,
        row.checksum(first, second));
    if (!pair.matches.empty())
      impl_->addColmapPair(first, second, pair, camera);
    impl_->commitSometimes();
  });
}

std::vector<ScanDatabase::StoredImage>
ScanDatabase::images()
{
  return impl_->use([&] {
    std::vector<StoredImage> images;
    Query query(impl_->connection,
                "SELECT image_id, CAST(name AS BLOB), content, width, height, params FROM images "
                "JOIN bundle_icp_features USING (image_id) JOIN cameras USING (camera_id) "
                "ORDER BY image_id");
    while (query.next())
      images.push_back({query.integer(0), query.bytes(1), std::uint64_t(query.integer(2)),
                        toCamera(int(query.integer(3)), int(query.integer(4)), query.bytes(5))});
    return images;
  });
}

std::vector<ScanDatabase::StoredPair>
ScanDatabase::pairs()
{
  return impl_->use([&] {
    std::vector<StoredPair> pairs;
    Query query(impl_->connection,
                "SELECT first, second, settings FROM bundle_icp_pairs ORDER BY pair_id");
    while (query.next())
      pairs.push_back({query.integer(0), query.integer(1), std::uint64_t(query.integer(2))});
    return pairs;
  });
}

void
ScanDatabase::takeFrom(ScanDatabase& other)
{
  std::set<std::string> names;
  for (const StoredImage& image : images())
    names.insert(image.name);
  std::map<ImageId, std::pair<ImageId, CameraIntrinsics>> taken;
  for (const StoredImage& old : other.images()) {
    const std::optional<Features> features = other.features(old.id);
    if (!features || names.count(old.name))
      continue;
    taken[old.id] = {image(old.name, old.content, old.camera), old.camera};
    addFeatures(taken[old.id].first, *features);
  }
  for (const auto& [first, second, settings] : other.pairs())
    if (taken.count(first) && taken.count(second))
      addPair(taken[first].first, taken[second].first, settings,
              other.pair(first, second, settings).value(), taken[first].second);
  commit();
}

std::optional<std::string>
ScanDatabase::map(std::uint64_t fingerprint)
{
  return impl_->use([&]() -> std::optional<std::string> {
    Query query(impl_->connection,
                "SELECT state, checksum FROM bundle_icp_map WHERE fingerprint = ?",
                std::int64_t(fingerprint));
    if (!query.next())
      return std::nullopt;
    const Bytes state = query.bytes(0);
    if (checksumOf(fingerprint, state) != query.integer(1))
      impl_->connection.failDamaged();
    return state;
  });
}

void
ScanDatabase::setMap(std::uint64_t fingerprint, const std::string& state)
{
  impl_->use([&] {
    impl_->begin();
    run(impl_->connection, "DELETE FROM bundle_icp_map");
    run(impl_->connection, "INSERT INTO bundle_icp_map VALUES (?, ?, ?)", std::int64_t(fingerprint),
        state, checksumOf(fingerprint, state));
    impl_->commit();
  });
}

void
ScanDatabase::commit()
{
  impl_->use([&] { impl_->commit(); });
}

} // namespace bundle_icp
