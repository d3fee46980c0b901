// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/printable_text.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

using bundle_icp::printable;

TEST(Printable, KeepsTextOfAllLanguages)
{
  for (const char* text :
       {"", "rgb/1.5.png", "Z\u00fcrich", "\u6570\u636e", "\U0001f600", "two\nlines"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, EscapesWhatIsNoCharacter)
{
  EXPECT_EQ(printable("a\xff\xfe.png"), "a\\xff\\xfe.png");
  EXPECT_EQ(printable("cut \xe6\x95"), "cut \\xe6\\x95");
  EXPECT_EQ(printable("\xc0\xaf"), "\\xc0\\xaf");                   // longer than needed
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");          // half of a pair
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80"); // beyond Unicode
}

TEST(Printable, EscapesWhatATerminalObeys)
{
  EXPECT_EQ(printable("\x1b[2Jgone"), "\\x1b[2Jgone");
  EXPECT_EQ(printable("\xc2\x9b[2J"), "\\xc2\\x9b[2J");
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\x00b");
}

TEST(Printable, GivesTextThatJsonTakes)
{
  std::string all;
  for (int first = 0; first < 256; ++first)
    for (int second = 0; second < 256; ++second)
      all += {char(first), char(second)};
  EXPECT_NO_THROW(nlohmann::json(printable(all)).dump());
  EXPECT_ANY_THROW(nlohmann::json(all).dump());
}
