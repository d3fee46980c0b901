// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/exceptions.h>

#include <sqlite3.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>

namespace bundle_icp {

using Bytes = std::string;

/** A connection; failures become pcl::IOException. */
class Connection {
public:
  explicit Connection(const std::string& path) : path_(path)
  {
    const int code = sqlite3_open_v2(path.c_str(), &handle_,
                                     SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
    if (code == SQLITE_OK)
      return;
    const std::string reason = reasonOf(code);
    sqlite3_close(handle_);
    throw IOException(path + ": " + reason);
  }

  ~Connection()
  {
    for (const auto& [sql, statement] : statements_)
      sqlite3_finalize(statement);
    sqlite3_close(handle_);
  }

  Connection(const Connection&) = delete;
  Connection&
  operator=(const Connection&) = delete;

  void
  execute(const char* sql)
  {
    check(sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr));
  }

  /** Compiled once. */
  sqlite3_stmt*
  statement(const char* sql)
  {
    sqlite3_stmt*& statement = statements_[sql];
    if (!statement)
      check(sqlite3_prepare_v3(handle_, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement, nullptr));
    return statement;
  }

  void
  check(int code) const
  {
    if (code != SQLITE_OK)
      throw IOException(path_ + ": " + reasonOf(code));
  }

  void
  rollBack()
  {
    if (!sqlite3_get_autocommit(handle_))
      sqlite3_exec(handle_, "ROLLBACK", nullptr, nullptr, nullptr);
  }

  [[noreturn]] void
  failDamaged() const
  {
    throw IOException(path_ + ": " + reasonOf(SQLITE_CORRUPT));
  }

  std::int64_t
  lastInserted() const
  {
    return sqlite3_last_insert_rowid(handle_);
  }

  const std::string&
  path() const
  {
    return path_;
  }

private:
  std::string
  reasonOf(int code) const
  {
    const int system_error = handle_ ? sqlite3_system_errno(handle_) : 0;
    switch (code & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return system_error == ENOLCK ? "its file system has no locks; choose OUT elsewhere"
                                    : "another run uses it; wait until that has ended";
    case SQLITE_NOTADB:
      return "is no scan database; move it away";
    case SQLITE_CORRUPT:
      return "is damaged; move it away";
    case SQLITE_IOERR:
      return std::string("cannot be read or written: ") +
             (system_error != 0 ? std::strerror(system_error) : sqlite3_errmsg(handle_));
    case SQLITE_FULL:
      return "the disk is full";
    case SQLITE_READONLY:
      return "may not be written";
    default:
      return std::string(handle_ ? sqlite3_errmsg(handle_) : "out of memory") +
             (system_error != 0 ? std::string(": ") + std::strerror(system_error) : "");
    }
  }

  const std::string path_;
  sqlite3* handle_ = nullptr;
  std::map<std::string, sqlite3_stmt*> statements_;
};

/** One use of a statement: values for its question marks, then its rows. */
class Query {
public:
  template <class... Values>
  Query(Connection& connection, const char* sql, const Values&... values)
  : connection_(connection), statement_(connection.statement(sql))
  {
    int place = 0;
    (bind(++place, values), ...);
  }

  ~Query()
  {
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
  }

  Query(const Query&) = delete;
  Query&
  operator=(const Query&) = delete;

  /** \return whether there is another row. */
  bool
  next()
  {
    const int code = sqlite3_step(statement_);
    if (code != SQLITE_ROW && code != SQLITE_DONE)
      connection_.check(code);
    return code == SQLITE_ROW;
  }

  std::int64_t
  integer(int column) const
  {
    return sqlite3_column_int64(statement_, column);
  }

  double
  real(int column) const
  {
    return sqlite3_column_double(statement_, column);
  }

  Bytes
  bytes(int column) const
  {
    const void* const data = sqlite3_column_blob(statement_, column);
    return data ? Bytes(static_cast<const char*>(data),
                        std::size_t(sqlite3_column_bytes(statement_, column)))
                : Bytes();
  }

private:
  void
  bind(int place, std::int64_t value)
  {
    connection_.check(sqlite3_bind_int64(statement_, place, value));
  }

  void
  bind(int place, double value)
  {
    connection_.check(sqlite3_bind_double(statement_, place, value));
  }

  void
  bind(int place, const Bytes& value)
  {
    connection_.check(
        sqlite3_bind_blob64(statement_, place, value.data(), value.size(), SQLITE_TRANSIENT));
  }

  Connection& connection_;
  sqlite3_stmt* const statement_;
};

template <class... Values>
void
run(Connection& connection, const char* sql, const Values&... values)
{
  Query(connection, sql, values...).next();
}

inline std::int64_t
number(Connection& connection, const char* sql)
{
  Query query(connection, sql);
  return query.next() ? query.integer(0) : 0;
}

} // namespace bundle_icp
