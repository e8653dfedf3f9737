#pragma once

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "test/volume/test_files.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration {
namespace reading {

/// Reads a file many times with a few of its first bytes changed. Each is a CT or refused by a VolumeError; anything
/// else fails the test or ends it. `path` names what is read, `file` what is changed.
inline void expectDamageIsReadOrRefused(const std::string& path, const std::string& file, std::size_t header_bytes,
                                        int times = 400) {
  std::ifstream stream(file, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  std::mt19937 random(7);
  int refused = 0;
  for (int i = 0; i < times; ++i) {
    std::string bytes = whole;
    for (unsigned change = 0; change <= random() % 4; ++change) {
      bytes[random() % header_bytes] = static_cast<char>(random() % 3 == 0 ? 0xff : random() % 256);
    }
    test_files::writeBytes(file, bytes);
    try {
      const Volume ct = readVolume(path, {}, {});
      EXPECT_EQ(ct.hu.size(), ct.grid.voxelCount());
    } catch (const VolumeError&) {
      ++refused;
    } catch (const std::exception& error) {
      ADD_FAILURE() << "of another kind: " << error.what();
    }
  }
  EXPECT_GT(refused, 0);
}

}  // namespace reading
}  // namespace xray_registration
