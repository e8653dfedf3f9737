// NRRD and MetaImage files as other programs leave them.
#include <gtest/gtest.h>
#include <zlib.h>

#include "test/volume/random_damage.h"
#include "test/volume/reading.h"
#include "test/volume/test_files.h"

namespace xray_registration {
namespace {

using reading::expectContains;
using reading::expectPlace;
using reading::read;
using reading::refusal;
using test_files::bytesOf;
using test_files::TemporaryFolder;
using test_files::writeBytes;

const Eigen::Vector3d kLastVoxel(3, 2, 1);

std::vector<std::int16_t> someHu() {
  std::vector<std::int16_t> hu(24);
  for (std::size_t i = 0; i < hu.size(); ++i) hu[i] = static_cast<std::int16_t>(100 * static_cast<int>(i) - 1000);
  return hu;
}

std::string packedBytes(const std::string& bytes, int window_bits) {
  std::string out(compressBound(bytes.size()) + 64, '\0');
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

class NrrdFiles : public testing::Test {
 protected:
  // 4 x 3 x 2 voxels; `place`: the lines that say where they lie.
  std::string write(const std::string& place, const std::string& name = "a.nrrd") const {
    writeBytes(folder_ / name, "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 3 2\nendian: little\nencoding: raw\n" +
                                   place + "\n" + bytesOf(someHu()));
    return folder_ / name;
  }

  TemporaryFolder folder_;
};

constexpr char kPlace[] = "space directions: (2,0,0) (0,3,0) (0,0,4)\nspace origin: (10,20,30)\n";

TEST_F(NrrdFiles, EverySpaceIsTurnedToLps) {
  const struct {
    const char* space;
    Eigen::Vector3d last;
  } cases[] = {{"left-posterior-superior", {16, 26, 34}},
               {"LPS", {16, 26, 34}},
               {"right-anterior-superior", {-16, -26, 34}},
               {"RAS", {-16, -26, 34}},
               {"left-anterior-superior", {16, -26, 34}},
               {"LAS", {16, -26, 34}},
               {"scanner-xyz", {16, 26, 34}}};
  for (const auto& [space, last] : cases) {
    const auto [ct, warned, said] = read(write(std::string("space: ") + space + "\n" + kPlace));
    expectPlace(ct, kLastVoxel, last);
    EXPECT_EQ(ct.hu, someHu());
    EXPECT_EQ(warned, "") << space;
  }
}

TEST_F(NrrdFiles, WithoutASpaceThatNamesDirectionsOneIsTakenAndSaid) {
  for (const char* space : {"space dimension: 3\n", "space: 3D-right-handed\n"}) {
    const auto [ct, warned, said] = read(write(std::string(space) + kPlace));
    expectPlace(ct, kLastVoxel, {16, 26, 34});
    expectContains(warned, "ct/orientation");
    VolumeReadOptions options;
    options.orientation = "RAS";
    const auto told = read(write(std::string(space) + kPlace), options);
    expectPlace(told.ct, kLastVoxel, {-16, -26, 34});
    EXPECT_EQ(told.warned, "");
  }
}

TEST_F(NrrdFiles, SpacingsAndAxisMinsAlone) {
  auto [ct, warned, said] = read(write("spacings: 2 3 4\naxis mins: 10 20 30\n"));
  expectPlace(ct, kLastVoxel, {16, 26, 34});
  expectContains(warned, "ct/orientation");
  // Of a cell the minimum is a face.
  ct = read(write("spacings: 2 3 4\naxis mins: 10 20 30\ncenterings: cell cell cell\n")).ct;
  expectPlace(ct, kLastVoxel, {17, 27.5, 36});
  expectContains(read(write("")).warned, "no voxel size");
}

TEST_F(NrrdFiles, UnitsScaleTheOriginToo) {
  const struct {
    const char* unit;
    double factor;
  } cases[] = {{"mm", 1.0}, {"millimeters", 1.0}, {"um", 0.001}, {"micron", 0.001}, {"cm", 10.0}, {"m", 1000.0}};
  for (const auto& [unit, factor] : cases) {
    const std::string quoted = std::string(" \"") + unit + "\"";
    std::ostringstream place;
    place << "space: LPS\nspace units:" << quoted << quoted << quoted << "\nspace directions: (" << 2 / factor
          << ",0,0) (0," << 3 / factor << ",0) (0,0," << 4 / factor << ")\nspace origin: (" << 10 / factor << ","
          << 20 / factor << "," << 30 / factor << ")\n";
    const auto [ct, warned, said] = read(write(place.str()));
    expectPlace(ct, kLastVoxel, {16, 26, 34});
    EXPECT_EQ(warned, "") << unit;
  }
  const std::string parsec = "space: LPS\nspace units: \"pc\" \"pc\" \"pc\"\n";
  expectContains(read(write(parsec + kPlace)).warned, "'pc', is not known");
  expectContains(refusal(write(std::string("space: LPS\nspace units: \"mm\" \"mm\" \"cm\"\n") + kPlace)),
                 "different units");
  EXPECT_NEAR(read(write("spacings: 2000 3000 4000\nunits: \"um\" \"um\" \"um\"\n")).ct.grid.spacing_mm.z(), 4.0, 1e-9);
}

TEST_F(NrrdFiles, ZeroSpacingIsRefused) {
  EXPECT_NE(refusal(write("spacings: 2 0 4\n")), "read without an error");
  EXPECT_NE(refusal(write("space: LPS\nspace directions: (2,0,0) (0,0,0) (0,0,4)\nspace origin: (1,2,3)\n")),
            "read without an error");
}

TEST_F(NrrdFiles, RawDataShorterThanTheHeaderSaysAreRefused) {
  const std::string header = "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 3 2\nspace: LPS\n" + std::string(kPlace) +
                             "endian: little\nencoding: raw\n";
  const std::string bytes = bytesOf(someHu());
  writeBytes(folder_ / "attached.nrrd", header + "\n" + bytes.substr(1));
  expectContains(refusal(folder_ / "attached.nrrd"), "attached.nrrd");
  const struct {
    const char* skip;
    std::string before;
    std::size_t missing;
  } cases[] = {{"", "", 1},
               {"byte skip: 100\n", std::string(100, 'x'), 1},
               {"line skip: 1\n", "a line\n", 1},
               {"byte skip: -1\n", "", 1}};
  for (const auto& [skip, before, missing] : cases) {
    writeBytes(folder_ / "a.nhdr", header + skip + "data file: a.raw\n\n");
    writeBytes(folder_ / "a.raw", before + bytes);
    EXPECT_EQ(read(folder_ / "a.nhdr").ct.hu, someHu()) << skip;
    writeBytes(folder_ / "a.raw", before + bytes.substr(missing));
    EXPECT_NE(refusal(folder_ / "a.nhdr"), "read without an error") << skip;
  }
  std::filesystem::remove(folder_ / "a.raw");
  EXPECT_NE(refusal(folder_ / "a.nhdr"), "read without an error");
}

TEST_F(NrrdFiles, CompressedDataThatEndEarlyAreRefused) {
  std::vector<std::int16_t> hu(40 * 40 * 40);
  unsigned noise = 1;
  for (auto& value : hu) value = static_cast<std::int16_t>((noise = noise * 1664525U + 1013904223U) >> 20U);
  const std::string header = "NRRD0004\ntype: short\ndimension: 3\nsizes: 40 40 40\nspace: LPS\n" +
                             std::string(kPlace) + "endian: little\nencoding: gzip\n\n";
  const std::string packed = packedBytes(bytesOf(hu), 15 + 16);
  writeBytes(folder_ / "a.nrrd", header + packed);
  VolumeReadOptions options;
  options.check_values = false;
  EXPECT_EQ(read(folder_ / "a.nrrd", options).ct.hu, hu);
  writeBytes(folder_ / "a.nrrd", header + packed.substr(0, packed.size() / 2));
  EXPECT_NE(refusal(folder_ / "a.nrrd"), "read without an error");
}

TEST_F(NrrdFiles, AHeaderThatClaimsMoreThanTheFileHoldsIsRefused) {
  for (const char* encoding : {"raw", "gzip", "ascii"}) {
    writeBytes(folder_ / "a.nrrd", "NRRD0004\ntype: short\ndimension: 3\nsizes: 1200 1200 1200\nspace: LPS\n" +
                                       std::string(kPlace) + "endian: little\nencoding: " + encoding + "\n\n" +
                                       std::string(1000, '1'));
    expectContains(refusal(folder_ / "a.nrrd"), "truncated or damaged");
  }
}

TEST_F(NrrdFiles, AHeaderThatCannotBeReadIsSaidInOneLine) {
  const std::string message = refusal(write("centering: cell\n"));
  expectContains(message, "its header cannot be read");
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

TEST_F(NrrdFiles, DamagedHeadersAreReadOrRefused) {
  const std::string path = write(std::string("space: RAS\nspace units: \"mm\" \"mm\" \"mm\"\n") + kPlace);
  reading::expectDamageIsReadOrRefused(path, path, 180);
}

TEST_F(NrrdFiles, ContentUnderAWrongNameIsNamed) {
  expectContains(refusal(write(std::string("space: LPS\n") + kPlace, "a.nii")), "name it .nrrd");
}

class MetaImageFiles : public testing::Test {
 protected:
  // `more`: lines before the last one.
  std::string write(const std::string& more, const std::string& bytes, const std::string& name = "a.mha",
                    const std::string& data = "LOCAL") const {
    writeBytes(folder_ / name, "ObjectType = Image\nNDims = 3\n" + more + "DimSize = 4 3 2\nElementType = MET_SHORT\n" +
                                   "ElementDataFile = " + data + "\n" + bytes);
    return folder_ / name;
  }

  TemporaryFolder folder_;
};

const std::string kMetaPlace = "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 10 20 30\nElementSpacing = 2 3 4\n";

TEST_F(MetaImageFiles, HeaderSizeCountsBeforeTheVoxels) {
  const std::string bytes = bytesOf(someHu());
  for (const char* size : {"77", "-1"}) {
    const std::string header = kMetaPlace + "HeaderSize = " + size + "\n";
    write(header, "", "a.mhd", "a.raw");
    writeBytes(folder_ / "a.raw", std::string(77, 'x') + bytes);
    EXPECT_EQ(read(folder_ / "a.mhd").ct.hu, someHu()) << size;
    expectPlace(read(folder_ / "a.mhd").ct, kLastVoxel, {16, 26, 34});
  }
  write(kMetaPlace + "HeaderSize = 77\n", "", "a.mhd", "a.raw");
  writeBytes(folder_ / "a.raw", std::string(77, 'x') + bytes.substr(1));
  expectContains(refusal(folder_ / "a.mhd"), "truncated or damaged");
  writeBytes(folder_ / "a.raw", bytes);  // As long as the voxels alone.
  expectContains(refusal(folder_ / "a.mhd"), "truncated or damaged");
}

TEST_F(MetaImageFiles, CompressedDataWithAndWithoutTheirSize) {
  std::vector<std::int16_t> hu(24);
  unsigned noise = 1;
  for (auto& value : hu) value = static_cast<std::int16_t>((noise = noise * 1664525U + 1013904223U) >> 20U);
  std::string big_endian = bytesOf(hu);
  for (std::size_t i = 0; i < big_endian.size(); i += 2) std::swap(big_endian[i], big_endian[i + 1]);
  for (const bool is_big : {false, true}) {
    const std::string packed = packedBytes(is_big ? big_endian : bytesOf(hu), 15);
    for (const bool has_size : {false, true}) {
      const std::string header = kMetaPlace +
                                 "CompressedData = True\nBinaryDataByteOrderMSB = " + (is_big ? "True\n" : "False\n") +
                                 (has_size ? "CompressedDataSize = " + std::to_string(packed.size()) + "\n" : "");
      EXPECT_EQ(read(write(header, packed)).ct.hu, hu);
      expectContains(refusal(write(header, packed.substr(0, packed.size() / 2))), "truncated or damaged");
    }
  }
}

TEST_F(MetaImageFiles, WithoutAMatrixOneIsTakenAndSaid) {
  const std::string place = "Offset = 10 20 30\nElementSpacing = 2 3 4\n";
  auto [ct, warned, said] = read(write(place, bytesOf(someHu())));
  expectPlace(ct, kLastVoxel, {16, 26, 34});
  expectContains(warned, "ct/orientation");
  VolumeReadOptions options;
  options.orientation = "RAS";
  expectPlace(read(write(place, bytesOf(someHu())), options).ct, kLastVoxel, {-16, -26, 34});
  EXPECT_EQ(read(write(kMetaPlace, bytesOf(someHu()))).warned, "");
}

TEST_F(MetaImageFiles, UnitsScaleTheOriginToo) {
  expectPlace(read(write(kMetaPlace + "DistanceUnits = cm\n", bytesOf(someHu()))).ct, kLastVoxel, {160, 260, 340});
  expectPlace(read(write("TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 10000 20000 30000\nElementSpacing = 2000 3000 "
                         "4000\nDistanceUnits = um\n",
                         bytesOf(someHu())))
                  .ct,
              kLastVoxel, {16, 26, 34});
}

TEST_F(MetaImageFiles, DamagedHeadersAreReadOrRefused) {
  for (const bool is_compressed : {false, true}) {
    const std::string bytes = bytesOf(someHu());
    const std::string header =
        kMetaPlace + "HeaderSize = 0\nCompressedData = " + (is_compressed ? "True\n" : "False\n");
    const std::string path = write(header, is_compressed ? packedBytes(bytes, 15) : bytes);
    reading::expectDamageIsReadOrRefused(path, path, 220);
  }
}

TEST_F(MetaImageFiles, ZeroSpacingIsRefused) {
  const std::string place = "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 10 20 30\nElementSpacing = 2 0 4\n";
  expectContains(refusal(write(place, bytesOf(someHu()))), "voxel size that is not positive");
}

TEST_F(MetaImageFiles, AHeaderThatClaimsMoreThanTheFileHoldsIsRefused) {
  for (const char* compressed : {"False", "True"}) {
    writeBytes(folder_ / "a.mha", "ObjectType = Image\nNDims = 3\n" + kMetaPlace + "CompressedData = " + compressed +
                                      "\nDimSize = 1200 1200 1200\nElementType = MET_SHORT\nElementDataFile = LOCAL\n" +
                                      packedBytes(std::string(100000, '\0'), 15));
    expectContains(refusal(folder_ / "a.mha"), "truncated or damaged");
  }
}

}  // namespace
}  // namespace xray_registration
