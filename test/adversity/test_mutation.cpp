// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mutation.h"

#include <gtest/gtest.h>

#include <set>

using namespace adversity;

namespace {

const std::string LIST = "# list\n0.1 rgb/1.png\n0.2 rgb/2.png\n-3e-2 5 x\n";

std::set<std::string>
changesOf(const std::string& bytes, bool is_text, unsigned seed)
{
  std::mt19937 random(seed);
  std::set<std::string> changes;
  for (int k = 0; k < 300; ++k)
    changes.insert(mutate(bytes, is_text, random).change);
  return changes;
}

bool
hasChange(const std::set<std::string>& changes, const std::string& part)
{
  for (const std::string& change : changes)
    if (change.find(part) != std::string::npos)
      return true;
  return false;
}

} // namespace

TEST(Mutation, TheSameSeedGivesTheSameMutants)
{
  std::mt19937 a(7), b(7);
  for (int k = 0; k < 100; ++k)
    EXPECT_EQ(mutate(LIST, true, a).bytes, mutate(LIST, true, b).bytes);
  EXPECT_NE(changesOf(LIST, true, 1), changesOf(LIST, true, 2));
}

TEST(Mutation, NumbersAndLinesChangeInTextAlone)
{
  const std::set<std::string> text = changesOf(LIST, true, 1), binary = changesOf(LIST, false, 1);
  for (const char* const part : {"flipped", "cut off", "inserted"}) {
    EXPECT_TRUE(hasChange(text, part)) << part;
    EXPECT_TRUE(hasChange(binary, part)) << part;
  }
  for (const char* const part : {"0.1 and 1 swapped", "-3e-2 replaced by", "line 2 deleted"}) {
    EXPECT_TRUE(hasChange(text, part)) << part;
    EXPECT_FALSE(hasChange(binary, part)) << part;
  }
}

TEST(Mutation, FilesWithoutNumbersAreDamagedAsWell)
{
  std::mt19937 random(1);
  for (int k = 0; k < 100; ++k)
    EXPECT_FALSE(mutate("x", true, random).change.empty());
}
