#include "ros/bag_structure.h"

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <cstring>
#include <fstream>
#include <iterator>

#include "ros/bag_message.h"
#include "xray_registration/ros/bag_session.h"

namespace xray_registration {
namespace {

class BagStructureTest : public testing::Test {
 protected:
  void TearDown() override { std::remove(path_.c_str()); }

  // A session of three images, in chunks of two.
  std::string session(rosbag::compression::CompressionType compression) const {
    rosbag::Bag bag(path_, rosbag::bagmode::Write);
    bag.setCompression(compression);
    bag.setChunkThreshold(1500);
    for (int i = 1; i <= 3; ++i) {
      const ros::Time stamp(i, 0);
      sensor_msgs::Image image;
      image.header.stamp = stamp;
      image.header.frame_id = "xray";
      image.encoding = "mono8";
      image.width = image.height = image.step = 20;
      image.data.assign(400, static_cast<std::uint8_t>(i));
      sensor_msgs::CameraInfo info;
      info.header = image.header;
      info.width = info.height = 20;
      info.K = {100, 0, 10, 0, 100, 10, 0, 0, 1};
      info.P = {100, 0, 10, 0, 0, 100, 10, 0, 0, 0, 1, 0};
      bag.write("/image_raw", stamp, image);
      bag.write("/camera_info", stamp, info);
    }
    bag.close();
    std::ifstream stream(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  std::string damage(const std::string& bytes) const {
    std::ofstream(path_, std::ios::binary) << bytes;
    return bagDamage(path_).value_or("");
  }

  // With `value` for the number of a field that is found `skipped` occurrences on.
  template <typename T>
  static std::string withField(std::string bytes, const std::string& name, T value, int skipped = 0) {
    std::size_t place = bytes.find(name + '=');
    for (; skipped > 0; --skipped) place = bytes.find(name + '=', place + 1);
    EXPECT_NE(place, std::string::npos) << name;
    std::memcpy(&bytes[place + name.size() + 1], &value, sizeof value);
    return bytes;
  }

  std::string path_ =
      testing::TempDir() + "bag_structure_" + testing::UnitTest::GetInstance()->current_test_info()->name() + ".bag";
};

using rosbag::compression::BZ2;
using rosbag::compression::LZ4;
using rosbag::compression::Uncompressed;

TEST_F(BagStructureTest, WholeBags) {
  for (const auto compression : {Uncompressed, LZ4, BZ2}) {
    EXPECT_EQ(damage(session(compression)), "") << compression;
    EXPECT_EQ(BagSession(path_).frameCount(), 3U);
  }
}

TEST_F(BagStructureTest, WhatRosbagRefusesByItself) {
  EXPECT_EQ(damage(""), "");
  EXPECT_EQ(damage("notes, of more than thirteen bytes\n"), "");
  EXPECT_EQ(damage(withField(session(LZ4), "index_pos", std::uint64_t{0})), "");
}

TEST_F(BagStructureTest, CutOffAnywhere) {
  const std::string bytes = session(LZ4);
  for (std::size_t length = 13; length < bytes.size(); length += length < 13000 ? 31 : 1) {
    EXPECT_NE(damage(bytes.substr(0, length)), "") << length << " of " << bytes.size();
  }
}

TEST_F(BagStructureTest, NumbersThatPromiseTooMuch) {
  const std::string packed = session(LZ4);
  const std::string open = session(Uncompressed);
  const std::string bz2 = session(BZ2);
  EXPECT_NE(damage(withField(packed, "index_pos", std::uint64_t{100})).find("index"), std::string::npos);
  EXPECT_NE(damage(withField(packed, "index_pos", ~std::uint64_t{0})).find("index"), std::string::npos);
  EXPECT_NE(damage(withField(packed, "chunk_pos", std::uint64_t{20})).find("no chunk"), std::string::npos);
  EXPECT_NE(damage(withField(packed, "size", std::uint32_t{0xf0000000})).find("2 GiB"), std::string::npos);
  EXPECT_NE(damage(withField(packed, "size", std::uint32_t{0x40000000})).find("can hold"), std::string::npos);
  EXPECT_NE(damage(withField(bz2, "size", std::uint32_t{0x40000000})).find("another size"), std::string::npos);
  EXPECT_NE(damage(withField(open, "size", std::uint32_t{17})).find("another size"), std::string::npos);
  EXPECT_NE(damage(withField(open, "ver", std::uint32_t{1}, 0).replace(0, 13, "#ROSBAG V1.2\n")), "");
}

// Where a message begins is what rosbag follows without a look.
TEST_F(BagStructureTest, AnIndexThatPointsBesideItsMessages) {
  std::string bytes = session(Uncompressed);
  const std::size_t count = bytes.find("count=", bytes.find("ver="));
  ASSERT_NE(count, std::string::npos);
  // The header of an index: ver, conn, count and op in rosbag's order; behind it the data's length and the first entry.
  const std::size_t header = bytes.rfind("op=\x04", bytes.size());
  ASSERT_NE(header, std::string::npos);
  for (std::size_t place = bytes.find("op=\x04"); place != std::string::npos;
       place = bytes.find("op=\x04", place + 1)) {
    std::size_t end = place + 4;
    while (std::memcmp(&bytes[end + 4], "ver=", 4) == 0) end += 4 + 8;
    const std::size_t offset = end + 4 + 8;
    std::string moved = bytes;
    std::uint32_t value = 0;
    std::memcpy(&value, &moved[offset], sizeof value);
    value += 1;
    std::memcpy(&moved[offset], &value, sizeof value);
    EXPECT_NE(damage(moved).find("no message"), std::string::npos) << place;
  }
}

// Any one byte: read, or refused, and never more than that. What the sanitizers see is what this is for.
TEST_F(BagStructureTest, AnyByteMayBeWrong) {
  for (const auto compression : {Uncompressed, LZ4}) {
    const std::string bytes = session(compression);
    int read = 0;
    int refused = 0;
    for (std::size_t place = 0; place < bytes.size(); place += 17) {
      std::string wrong = bytes;
      wrong[place] = static_cast<char>(wrong[place] ^ (place % 2 == 0 ? 0xff : 0x04));
      std::ofstream(path_, std::ios::binary) << wrong;
      try {
        const BagSession session(path_);
        for (std::size_t i = 0; i < session.frameCount(); ++i) session.frame(i);
        ++read;
      } catch (const BagSessionError& error) {
        EXPECT_NE(std::string(error.what()), "");
        ++refused;
      }
    }
    EXPECT_GT(read, 0);
    EXPECT_GT(refused, 0);
  }
}

template <typename Message>
std::vector<std::uint8_t> serialised(const Message& message) {
  std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

template <typename Message>
bool fits(const std::vector<std::uint8_t>& bytes) {
  return messageFits(messageLayout<Message>(), bytes.data(), bytes.size());
}

// A count of 2³² − 1 in place of each list's own.
template <typename Message>
void expectListIsChecked(const Message& message, std::uint32_t count) {
  const std::vector<std::uint8_t> bytes = serialised(message);
  EXPECT_TRUE(fits<Message>(bytes));
  int found = 0;
  for (std::size_t place = 0; place + 4 <= bytes.size(); ++place) {
    std::uint32_t value = 0;
    std::memcpy(&value, &bytes[place], sizeof value);
    if (value != count) continue;
    ++found;
    std::vector<std::uint8_t> wrong = bytes;
    std::memset(&wrong[place], 0xff, sizeof value);
    EXPECT_FALSE(fits<Message>(wrong));
  }
  EXPECT_EQ(found, 1);
}

TEST(BagMessage, ListsThatAreShorterThanTheySay) {
  sensor_msgs::Image image;
  image.header.frame_id = "xray";
  image.encoding = "mono16";
  image.data.assign(777, 1);
  expectListIsChecked(image, 777);
  sensor_msgs::CameraInfo info;
  info.header.frame_id = "xray";
  info.distortion_model = "plumb_bob";
  info.D.assign(777, 0.5);
  expectListIsChecked(info, 777);
  tf2_msgs::TFMessage transforms;
  transforms.transforms.resize(777);
  for (auto& transform : transforms.transforms) {
    transform.header.frame_id = "carm";
    transform.child_frame_id = "xray";
  }
  expectListIsChecked(transforms, 777);
}

}  // namespace
}  // namespace xray_registration
