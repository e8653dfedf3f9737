#include "xray_registration/common/names.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

TEST(Names, PartsOfRosNames) {
  for (const char* good : {"T12", "a", "left_hip_2"}) EXPECT_TRUE(isName(good)) << good;
  for (const char* bad : {"", "_a", "1a", "a/b", "a.b", "..", "a b", "a\n", "é"}) EXPECT_FALSE(isName(bad)) << bad;
  EXPECT_FALSE(isName(std::string("a\0b", 3)));
  EXPECT_TRUE(isName(std::string(100, 'a')));
  EXPECT_FALSE(isName(std::string(101, 'a')));
}

TEST(Names, Paths) {
  for (const char* good : {"ap", "/ap", "carm/ap_2", "carm/2nd"}) EXPECT_TRUE(isNamePath(good)) << good;
  for (const char* bad :
       {"", "/", "//ap", "ap/", "carm//ap", "../ap", "carm/../ap", "./ap", "1ap", "_x", "a\x1b", "~ap"}) {
    EXPECT_FALSE(isNamePath(bad)) << bad;
  }
  // As long as this a regular expression of the standard library's ends the process.
  EXPECT_FALSE(isNamePath(std::string(std::size_t{1} << 20U, 'a')));
}

TEST(Names, AsNamesOfFiles) {
  EXPECT_EQ(asFileName("carm/ap"), "carm_ap");
  EXPECT_EQ(asFileName("ap"), "ap");
}

TEST(Names, Frames) {
  for (const char* good : {"ap_optical", "tool0", "robot/base-link", "a.b:c"}) EXPECT_TRUE(isFrameName(good)) << good;
  for (const char* bad : {"", "a b", "a\"b", "$(eval 1)", "a<b", "a\nb", "a&b", "é"})
    EXPECT_FALSE(isFrameName(bad)) << bad;
}

}  // namespace
}  // namespace xray_registration
