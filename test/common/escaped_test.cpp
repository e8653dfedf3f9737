#include "xray_registration/common/escaped.h"

#include <gtest/gtest.h>

#include "xray_registration/common/log.h"

namespace xray_registration {
namespace {

TEST(Escaped, KeepsWhatIsText) {
  for (const char* text : {"", "ct.nii.gz", "C:\\data\\n", "σ = 1.5 µm, 体", "\xf0\x9f\xa6\xb4"}) {
    EXPECT_EQ(escaped(text), text);
  }
}

TEST(Escaped, LinesAndOrdersToATerminal) {
  EXPECT_EQ(escaped("a\nb\r\n\tc"), "a\\nb\\r\\n\\tc");
  EXPECT_EQ(escaped("\x1b[2J\x1b]0;title\x07"), "\\x1b[2J\\x1b]0;title\\x07");
  EXPECT_EQ(escaped(std::string("a\0b\x7f", 4)), "a\\x00b\\x7f");
  // The control characters above 0x7f, in UTF-8: terminals may take 0x9b for an escape and a bracket.
  EXPECT_EQ(escaped("\xc2\x9b"
                    "31m"),
            "\\x9b31m");
}

TEST(Escaped, WhatTurnsTheDirectionOfWriting) {
  EXPECT_EQ(escaped("ct\xe2\x80\xaegpj.exe"), "ct\\u202egpj.exe");
  EXPECT_EQ(escaped("\xe2\x80\xa8"), "\\u2028");  // Breaks a line.
  EXPECT_EQ(escaped("\xef\xbb\xbf"), "\\ufeff");
}

TEST(Escaped, BytesThatAreNoUtf8) {
  EXPECT_EQ(escaped("\xff"), "\\xff");
  EXPECT_EQ(escaped("\xc3"), "\\xc3");           // Cut off.
  EXPECT_EQ(escaped("\xc0\x8a"), "\\xc0\\x8a");  // A line break in more bytes than it needs.
  EXPECT_EQ(escaped("\xe0\x80\x8a"), "\\xe0\\x80\\x8a");
  EXPECT_EQ(escaped("\xed\xa0\x80"), "\\xed\\xa0\\x80");  // Half of a surrogate.
  EXPECT_EQ(escaped("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
  EXPECT_EQ(escaped("\x9b[31m"), "\\x9b[31m");
}

TEST(Escaped, OnceIsEnough) {
  std::string all;
  for (int byte = 0; byte < 256; ++byte) all += static_cast<char>(byte);
  const std::string once = escaped(all);
  EXPECT_EQ(escaped(once), once);
  for (const char c : once) EXPECT_GE(c, ' ');
}

TEST(Escaped, LinesOfALibraryAreJoined) { EXPECT_EQ(onOneLine("bad\n\tfile \x1b[1m"), "bad  file \\x1b[1m"); }

TEST(Escaped, ErrorsAndLogs) {
  EXPECT_STREQ(EscapedError("'a\nb'").what(), "'a\\nb'");
  std::string said;
  log([&](LogLevel, const std::string& text) { said = text; }, LogLevel::kInfo, "'ct\n\x1b[0m'");
  EXPECT_EQ(said, "'ct\\n\\x1b[0m'");
}

}  // namespace
}  // namespace xray_registration
