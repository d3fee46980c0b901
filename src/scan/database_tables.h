// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/sqlite_connection.h"

/** The tables of a scan database. */
namespace bundle_icp {

constexpr std::int64_t APPLICATION_ID = 0x62696370; ///< "bicp", in the header of the file
constexpr std::int64_t SCHEMA_VERSION = 2;

/** Tables of COLMAP 3.8, then what they lack. PRAGMA user_version is COLMAP's. */
constexpr const char* TABLES = R"sql(
CREATE TABLE cameras (camera_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, model INTEGER NOT NULL,
  width INTEGER NOT NULL, height INTEGER NOT NULL, params BLOB,
  prior_focal_length INTEGER NOT NULL);
CREATE TABLE images (image_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, name TEXT NOT NULL UNIQUE,
  camera_id INTEGER NOT NULL, prior_qw REAL, prior_qx REAL, prior_qy REAL, prior_qz REAL,
  prior_tx REAL, prior_ty REAL, prior_tz REAL,
  CONSTRAINT image_id_check CHECK (image_id >= 0 AND image_id < 2147483647),
  FOREIGN KEY (camera_id) REFERENCES cameras (camera_id));
CREATE UNIQUE INDEX index_name ON images (name);
CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL,
  cols INTEGER NOT NULL, data BLOB,
  FOREIGN KEY (image_id) REFERENCES images (image_id) ON DELETE CASCADE);
CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL,
  cols INTEGER NOT NULL, data BLOB,
  FOREIGN KEY (image_id) REFERENCES images (image_id) ON DELETE CASCADE);
CREATE TABLE matches (pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL,
  cols INTEGER NOT NULL, data BLOB);
CREATE TABLE two_view_geometries (pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL,
  cols INTEGER NOT NULL, data BLOB, config INTEGER NOT NULL, F BLOB, E BLOB, H BLOB, qvec BLOB,
  tvec BLOB);

CREATE TABLE bundle_icp_schema (version INTEGER NOT NULL);
CREATE TABLE bundle_icp_features (image_id INTEGER PRIMARY KEY NOT NULL, content INTEGER NOT NULL,
  sharpness REAL, pixels BLOB, pixel_sigmas BLOB, depths BLOB, depth_sigmas BLOB,
  depth_slopes BLOB, colors BLOB, checksum INTEGER,
  FOREIGN KEY (image_id) REFERENCES images (image_id) ON DELETE CASCADE);
CREATE TABLE bundle_icp_pairs (pair_id INTEGER PRIMARY KEY NOT NULL, first INTEGER NOT NULL,
  second INTEGER NOT NULL, settings INTEGER NOT NULL, num_putative INTEGER NOT NULL, matches BLOB,
  first_from_second BLOB, other_matches BLOB, other_first_from_second BLOB,
  checksum INTEGER NOT NULL,
  FOREIGN KEY (first) REFERENCES images (image_id) ON DELETE CASCADE,
  FOREIGN KEY (second) REFERENCES images (image_id) ON DELETE CASCADE);
CREATE INDEX bundle_icp_pairs_first ON bundle_icp_pairs (first);
CREATE INDEX bundle_icp_pairs_second ON bundle_icp_pairs (second);
CREATE TABLE bundle_icp_map (fingerprint INTEGER PRIMARY KEY NOT NULL, state BLOB NOT NULL,
  checksum INTEGER NOT NULL);
CREATE TRIGGER bundle_icp_forget_pair AFTER DELETE ON bundle_icp_pairs BEGIN
  DELETE FROM matches WHERE pair_id = OLD.pair_id;
  DELETE FROM two_view_geometries WHERE pair_id = OLD.pair_id;
END;
)sql";

/** Makes a new file a scan database, and checks an older one. */
inline void
prepareTables(Connection& connection)
{
  // Also keeps other processes out, from the first access on.
  connection.execute("PRAGMA locking_mode = EXCLUSIVE");
  const std::int64_t application = number(connection, "PRAGMA application_id");
  const bool is_new =
      application == 0 && number(connection, "SELECT count(*) FROM sqlite_master") == 0;
  if (!is_new && application != APPLICATION_ID)
    throw IOException(connection.path() + ": is a database of another program; move it away");
  if (!is_new && number(connection, "SELECT version FROM bundle_icp_schema") != SCHEMA_VERSION)
    throw IOException(connection.path() +
                      ": is a scan database of another version of bundle_icp; move it away");
  // Large pages, and few visits to the disk: rows are large.
  connection.execute("PRAGMA page_size = 16384; PRAGMA journal_mode = WAL;"
                     "PRAGMA wal_autocheckpoint = 4096; PRAGMA synchronous = NORMAL;"
                     "PRAGMA foreign_keys = ON; BEGIN IMMEDIATE");
  if (is_new) {
    connection.execute(TABLES);
    run(connection, "INSERT INTO bundle_icp_schema VALUES (?)", SCHEMA_VERSION);
    connection.execute(("PRAGMA application_id = " + std::to_string(APPLICATION_ID)).c_str());
  }
  connection.execute("COMMIT");
}

} // namespace bundle_icp
