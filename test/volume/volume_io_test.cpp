#include "xray_registration/volume/volume_io.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>

#include "test/volume/test_files.h"

namespace xray_registration {
namespace {

using test_files::DicomFile;
using test_files::TemporaryFolder;
using test_files::writeBytes;
using test_files::writeDicom;
using test_files::writeNifti;

constexpr std::array<std::array<float, 4>, 3> kPlainRas = {
    {{{1.0F, 0.0F, 0.0F, 0.0F}}, {{0.0F, 1.0F, 0.0F, 0.0F}}, {{0.0F, 0.0F, 1.0F, 0.0F}}}};

Volume randomCt(const Eigen::Matrix3d& direction) {
  Volume ct;
  ct.grid.size = {7, 5, 4};
  ct.grid.spacing_mm = {0.7, 1.1, 2.5};
  ct.grid.origin_ct_mm = {-31.5, 12.25, 640.0};
  ct.grid.direction = direction;
  ct.hu.resize(ct.grid.voxelCount());
  std::mt19937 random(9);
  for (auto& hu : ct.hu) hu = static_cast<std::int16_t>(static_cast<int>(random() % 4096) - 1024);
  return ct;
}

Eigen::Matrix3d oblique() {
  return Eigen::AngleAxisd(0.4, Eigen::Vector3d(1.0, -1.0, 2.0).normalized()).toRotationMatrix();
}

// The exception's message, or what shows that there was none.
std::string refusal(const std::string& path, const VolumeReadOptions& options = {}) {
  try {
    readVolume(path, options, {});
  } catch (const VolumeError& error) {
    return error.what();
  }
  return "read without an error";
}

VolumeReadOptions below(const std::string& directory) {
  VolumeReadOptions options;
  options.directory = directory;
  return options;
}

VolumeReadOptions ofSeries(const std::string& uid) {
  VolumeReadOptions options;
  options.series_uid = uid;
  return options;
}

void expectContains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' is not in: " << text;
}

TEST(Files, EveryFormatKeepsFrameAndValuesInEveryOrientation) {
  const TemporaryFolder folder;
  Eigen::Matrix3d flipped = oblique();
  flipped.col(2) *= -1.0;
  Eigen::Matrix3d permuted = Eigen::Matrix3d::Zero();
  permuted(2, 0) = 1.0;
  permuted(0, 1) = -1.0;
  permuted(1, 2) = 1.0;
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  for (const Eigen::Matrix3d& direction : {identity, oblique(), flipped, permuted}) {
    const Volume written = randomCt(direction);
    for (const char* name : {"ct.nii", "ct.nii.gz", "ct.nrrd", "ct.mha", "ct.mhd"}) {
      writeVolume(written, folder / name);
      const Volume read = readVolume(folder / name, {}, {});
      // NIfTI keeps single precision.
      EXPECT_TRUE(read.grid.sameAs(written.grid, 2e-3)) << name << "\n" << direction << "\n" << read.grid.direction;
      EXPECT_EQ(read.hu, written.hu) << name;
      EXPECT_EQ(read.name, "ct");
    }
  }
}

TEST(Files, NiftiIsTurnedFromRasToLps) {
  const TemporaryFolder folder;
  const std::array<std::array<float, 4>, 3> ras = {
      {{{2.0F, 0.0F, 0.0F, -10.0F}}, {{0.0F, 0.0F, -3.0F, 20.0F}}, {{0.0F, 1.5F, 0.0F, 30.0F}}}};
  std::vector<std::int16_t> voxels(24);
  for (std::size_t i = 0; i < 24; ++i) voxels[i] = static_cast<std::int16_t>(i);
  writeNifti(folder / "a.nii", {4, 3, 2}, 4, voxels, ras);
  const Volume ct = readVolume(folder / "a.nii", {}, {});
  ASSERT_EQ(ct.grid.size, Eigen::Vector3i(4, 3, 2));
  const Eigen::Affine3d ct_from_index = ct.grid.ctFromIndex();
  for (const Eigen::Vector3d& index : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(3, 2, 1), Eigen::Vector3d(1, 0, 1)}) {
    const Eigen::Vector3d expected(10.0 - 2.0 * index.x(), -20.0 + 3.0 * index.z(), 30.0 + 1.5 * index.y());
    EXPECT_LT((ct_from_index * index - expected).norm(), 1e-4);  // Single precision of the header.
  }
  EXPECT_EQ(ct.hu, voxels);
}

TEST(Files, SlopeAndInterceptAreApplied) {
  const TemporaryFolder folder;
  writeNifti(folder / "a.nii", {2, 2, 2}, 4, std::vector<std::int16_t>{0, 1, 2, 3, 100, 1000, 1512, 2000}, kPlainRas,
             2.0F, -1024.0F);
  EXPECT_EQ(readVolume(folder / "a.nii", {}, {}).hu,
            (std::vector<std::int16_t>{-1024, -1022, -1020, -1018, -824, 976, 2000, 2976}));
}

TEST(Files, FloatsAreRoundedClampedAndFreedOfNan) {
  const TemporaryFolder folder;
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  writeNifti(folder / "a.nii", {2, 2, 2}, 16, std::vector<float>{nan, inf, -inf, 40.6F, -0.4F, 4e4F, -4e4F, -500.5F},
             kPlainRas);
  EXPECT_EQ(readVolume(folder / "a.nii", {}, {}).hu,
            (std::vector<std::int16_t>{-1000, -1000, -1000, 41, 0, 32767, -32768, -501}));
}

TEST(Files, OtherNumberTypesAreRead) {
  const TemporaryFolder folder;
  writeNifti(folder / "u8.nii", {2, 2, 2}, 2, std::vector<std::uint8_t>{0, 1, 2, 3, 4, 5, 6, 255}, kPlainRas);
  EXPECT_EQ(readVolume(folder / "u8.nii", {}, {}).hu, (std::vector<std::int16_t>{0, 1, 2, 3, 4, 5, 6, 255}));
  writeNifti(folder / "u16.nii", {2, 2, 2}, 512, std::vector<std::uint16_t>{0, 1, 2, 3, 4, 5, 6, 65535}, kPlainRas);
  EXPECT_EQ(readVolume(folder / "u16.nii", {}, {}).hu, (std::vector<std::int16_t>{0, 1, 2, 3, 4, 5, 6, 32767}));
  writeNifti(folder / "f64.nii", {2, 2, 2}, 64, std::vector<double>{0, 1, 2, 3, 4, 5, 6, -77.7}, kPlainRas);
  EXPECT_EQ(readVolume(folder / "f64.nii", {}, {}).hu, (std::vector<std::int16_t>{0, 1, 2, 3, 4, 5, 6, -78}));
}

TEST(Files, LabelsKeepSixteenBits) {
  const TemporaryFolder folder;
  writeNifti(folder / "l.nii", {2, 2, 2}, 512, std::vector<std::uint16_t>{0, 1, 2, 3, 4, 5, 6, 65535}, kPlainRas);
  const LabelVolume labels = readLabels(folder / "l.nii", {}, {});
  EXPECT_EQ(labels.labels, (std::vector<std::uint16_t>{0, 1, 2, 3, 4, 5, 6, 65535}));
  EXPECT_EQ(labels.grid.size, Eigen::Vector3i(2, 2, 2));
  writeNifti(folder / "f.nii", {2, 2, 2}, 16, std::vector<float>{0, 1, 2.2F, -3, std::nanf(""), 5, 6, 7}, kPlainRas);
  EXPECT_EQ(readLabels(folder / "f.nii", {}, {}).labels, (std::vector<std::uint16_t>{0, 1, 2, 0, 0, 5, 6, 7}));
}

TEST(Files, RefusesWhatIsNoSingleVolume) {
  const TemporaryFolder folder;
  writeNifti(folder / "4d.nii", {2, 2, 2, 2}, 4, std::vector<std::int16_t>(16), kPlainRas);
  expectContains(refusal(folder / "4d.nii"), "more than three dimensions");
  writeNifti(folder / "slice.nii", {4, 4, 1}, 4, std::vector<std::int16_t>(16), kPlainRas);
  expectContains(refusal(folder / "slice.nii"), "single slice");
  writeNifti(folder / "flat.nii", {4, 4}, 4, std::vector<std::int16_t>(16), kPlainRas);
  expectContains(refusal(folder / "flat.nii"), "single slice");
  writeNifti(folder / "rgb.nii", {2, 2, 2}, 128, std::vector<std::array<char, 3>>(8), kPlainRas);
  expectContains(refusal(folder / "rgb.nii"), "3 numbers per voxel");
  writeBytes(folder / "vector.mha",
             "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementNumberOfChannels = 2\nElementType = MET_SHORT\n"
             "ElementDataFile = LOCAL\n" +
                 std::string(32, '\0'));
  expectContains(refusal(folder / "vector.mha"), "2 numbers per voxel");
}

TEST(Files, RefusesShearedAxes) {
  const TemporaryFolder folder;
  writeBytes(folder / "sheared.nrrd",
             "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 2 2\n"
             "space directions: (1,0,0) (0,1,0) (0,0.3,1)\nkinds: domain domain domain\nendian: little\n"
             "encoding: raw\nspace origin: (0,0,0)\n\n" +
                 std::string(16, '\0'));
  expectContains(refusal(folder / "sheared.nrrd"), "right angles");
}

TEST(Files, RefusesWhatIsNotThereOrDamaged) {
  const TemporaryFolder folder;
  expectContains(refusal(""), "ct/path is empty");
  expectContains(refusal(folder / "missing.nii"), "no such file");
  expectContains(refusal(folder / "missing.nii"), folder / "missing.nii");
  writeBytes(folder / "text.nii", "this is no image\n");
  expectContains(refusal(folder / "text.nii"), "damaged");
  writeBytes(folder / "empty.nrrd", "");
  expectContains(refusal(folder / "empty.nrrd"), "empty");
  writeBytes(folder / "noise.bin", std::string(5000, '\x5a'));
  expectContains(refusal(folder / "noise.bin"), "NIfTI, NRRD, MetaImage or DICOM");
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  expectContains(refusal(folder / "pipe"), "neither a file nor a folder");
}

TEST(Files, RefusesTruncatedFilesOfEveryFormat) {
  const TemporaryFolder folder;
  Volume ct = randomCt(Eigen::Matrix3d::Identity());
  ct.grid.size = {40, 40, 40};
  ct.hu.assign(ct.grid.voxelCount(), 0);
  std::mt19937 random(2);
  for (auto& hu : ct.hu) hu = static_cast<std::int16_t>(random());  // Incompressible.
  for (const char* name : {"a.nii", "a.nii.gz", "a.nrrd", "a.mha"}) {
    writeVolume(ct, folder / name);
    std::filesystem::resize_file(folder / name, std::filesystem::file_size(folder / name) / 2);
    const std::string message = refusal(folder / name);
    expectContains(message, name);
  }
  writeBytes(folder / "raw.mha",
             "ObjectType = Image\nNDims = 3\nDimSize = 20 20 20\nElementType = MET_SHORT\nElementDataFile = LOCAL\n" +
                 std::string(500, '\0'));
  expectContains(refusal(folder / "raw.mha"), "raw.mha");
  writeBytes(folder / "raw.nrrd",
             "NRRD0004\ntype: short\ndimension: 3\nsizes: 20 20 20\nendian: little\nencoding: raw\n\n" +
                 std::string(500, '\0'));
  expectContains(refusal(folder / "raw.nrrd"), "raw.nrrd");
}

TEST(Files, RefusesImpossibleSizesWithoutAllocatingThem) {
  const TemporaryFolder folder;
  writeBytes(folder / "huge.mha",
             "ObjectType = Image\nNDims = 3\nDimSize = 100000 100000 100000\nElementType = MET_SHORT\n"
             "ElementDataFile = LOCAL\n" +
                 std::string(500, '\0'));
  expectContains(refusal(folder / "huge.mha"), "impossible number of voxels");
}

TEST(Writing, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  const Volume ct = randomCt(Eigen::Matrix3d::Identity());
  EXPECT_THROW(writeVolume(ct, folder / "a.jpg"), VolumeError);
  EXPECT_THROW(writeVolume(ct, folder / "no/such/folder/a.nii.gz"), VolumeError);
  EXPECT_THROW(writeVolume(ct, folder / "no/such/folder/a.nrrd"), VolumeError);
  EXPECT_THROW(writeVolume(ct, folder / "no/such/folder/a.mha"), VolumeError);
  EXPECT_THROW(writeVolume(Volume{}, folder / "a.nii"), VolumeError);
}

TEST(Directory, KeepsReadingBelowIt) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "allowed/sub");
  std::filesystem::create_directories(folder / "allowed_not");
  const Volume ct = randomCt(Eigen::Matrix3d::Identity());
  writeVolume(ct, folder / "allowed/sub/a.nii");
  writeVolume(ct, folder / "outside.nii");
  writeVolume(ct, folder / "allowed_not/a.nii");
  const VolumeReadOptions options = below(folder / "allowed");
  EXPECT_EQ(readVolume(folder / "allowed/sub/a.nii", options, {}).hu, ct.hu);
  expectContains(refusal(folder / "outside.nii", options), "outside ct/directory");
  expectContains(refusal(folder / "allowed_not/a.nii", options), "outside ct/directory");
  expectContains(refusal(folder / "allowed/../outside.nii", options), "outside ct/directory");
  expectContains(refusal(folder / "not_there.nii", options), "outside ct/directory");  // Nothing is told of elsewhere.
  std::filesystem::create_symlink(folder / "outside.nii", folder / "allowed/link.nii");
  expectContains(refusal(folder / "allowed/link.nii", options), "outside ct/directory");
  std::filesystem::create_symlink(folder / "allowed/sub/a.nii", folder / "into.nii");
  EXPECT_EQ(readVolume(folder / "into.nii", options, {}).hu, ct.hu);
  expectContains(refusal(folder / "into.nii", below(folder / "nowhere")), "ct/directory cannot be used");
}

TEST(Directory, HeadersMayNotReferElsewhere) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "allowed");
  writeBytes(folder / "secret.raw", std::string(16, '\1'));
  const VolumeReadOptions options = below(folder / "allowed");
  writeBytes(folder / "allowed/a.mhd",
             "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_SHORT\n"
             "ElementDataFile = ../secret.raw\n");
  writeBytes(folder / "allowed/a.nhdr",
             "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 2 2\nendian: little\nencoding: raw\n"
             "data file: ../secret.raw\n\n");
  for (const char* name : {"allowed/a.mhd", "allowed/a.nhdr"}) {
    EXPECT_EQ(readVolume(folder / name, {}, {}).hu[0], 0x0101)
        << name;  // Without the boundary it is a CT as any other.
    expectContains(refusal(folder / name, options), "outside ct/directory");
  }
}

// What the library that reads a header understands of it counts, not what a first look does.
TEST(Directory, HeadersMayNotHideWhereTheyRefer) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "allowed");
  writeBytes(folder / "secret.raw", std::string(16, '\1'));
  writeBytes(folder / "allowed/decoy.raw", std::string(16, '\2'));
  const VolumeReadOptions options = below(folder / "allowed");
  const std::string meta = "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_SHORT\n";
  const std::string nrrd = "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 2 2\nendian: little\nencoding: raw\n";
  writeBytes(folder / "allowed/empty_line.mhd", meta + "\nElementDataFile = ../secret.raw\n");
  writeBytes(folder / "allowed/two_lines.mhd",
             meta + "ElementDataFile\n= ../secret.raw\nElementDataFile = decoy.raw\n");
  writeBytes(folder / "allowed/long_line.nhdr",
             nrrd + "# " + std::string(5000, '.') + "\ndata file: ../secret.raw\n\n");
  std::string many_lines = nrrd;
  for (int i = 0; i < 11000; ++i) many_lines += "#\n";
  writeBytes(folder / "allowed/many_lines.nhdr", many_lines + "data file: ../secret.raw\n\n");
  for (const char* name : {"empty_line.mhd", "two_lines.mhd", "long_line.nhdr", "many_lines.nhdr"}) {
    EXPECT_THROW(readVolume(folder / (std::string("allowed/") + name), options, {}), VolumeError) << name;
  }
}

TEST(Directory, VoxelsBesideAHeaderMayNotLieElsewhere) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "allowed");
  writeVolume(randomCt(Eigen::Matrix3d::Identity()), folder / "outside.nii");
  std::ifstream stream(folder / "outside.nii", std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  bytes.replace(344, 3, "ni1");  // Its voxels are said to lie in the .img beside it.
  writeBytes(folder / "allowed/a.nii", bytes);
  std::filesystem::create_symlink(folder / "outside.nii", folder / "allowed/a.img");
  EXPECT_NO_THROW(readVolume(folder / "allowed/a.nii", {}, {}));
  expectContains(refusal(folder / "allowed/a.nii", below(folder / "allowed")), "outside ct/directory");
}

// ITK would read numbers without end.
TEST(VolumeFiles, MetaImagesOfNoDimensionsAreRefused) {
  const TemporaryFolder folder;
  for (const char* dimensions : {"NDims = -1\n", "NDims = 0\n", "NDims = 3\nNDims\n= -7\n", "NDims = 99999999\n"}) {
    writeBytes(folder / "a.mha", std::string("ObjectType = Image\n") + dimensions +
                                     "ElementSpacing = 1 1 1\nDimSize = 2 2 2\nElementType = MET_SHORT\n"
                                     "ElementDataFile = LOCAL\n" +
                                     std::string(16, '\1'));
    expectContains(refusal(folder / "a.mha"), "number of dimensions");
  }
}

TEST(VolumeFiles, APathWithAZeroByteIsRefused) {
  expectContains(refusal(std::string("/etc/passwd\0/ct.nii", 19)), "zero byte");
}

TEST(VolumeFiles, NamesOfFilesAreEscaped) {
  const std::string words = refusal("/nowhere/\x1b[2Jct\nERROR: all is well.nii");
  expectContains(words, "\\x1b[2Jct\\nERROR");
  EXPECT_EQ(words.find('\n'), std::string::npos);
}

// A series of slices with a value per voxel that tells its place: column + 10 row + 100 slice, raw.
class DicomSeries : public testing::Test {
 protected:
  std::vector<DicomFile> series(int slices, double spacing_mm = 2.5, const std::string& uid = "1.2.3.1") const {
    std::vector<DicomFile> files;
    for (int i = 0; i < slices; ++i) {
      DicomFile file;
      file.series_uid = uid;
      file.instance_uid = uid + "." + std::to_string(i + 1);
      file.position = {-40.0, 15.0, 100.0 + i * spacing_mm};
      file.pixel_spacing = {0.75, 0.5};
      file.columns = 6;
      file.rows = 4;
      for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 6; ++column) {
          file.pixels.push_back(static_cast<std::uint16_t>(column + 10 * row + 100 * i));
        }
      }
      files.push_back(file);
    }
    return files;
  }

  // Names that sort otherwise than the slices lie.
  void write(const std::vector<DicomFile>& files, const std::string& prefix = "I") const {
    for (std::size_t i = 0; i < files.size(); ++i) {
      writeDicom(folder_ / (prefix + std::to_string((i * 7 + 3) % 101) + ".dcm"), files[i]);
    }
  }

  TemporaryFolder folder_;
};

TEST_F(DicomSeries, SlicesAreOrderedAndInHounsfieldUnits) {
  write(series(8));
  const Volume ct = readVolume(folder_.path().string(), {}, {});
  ASSERT_EQ(ct.grid.size, Eigen::Vector3i(6, 4, 8));
  EXPECT_LT((ct.grid.spacing_mm - Eigen::Vector3d(0.5, 0.75, 2.5)).norm(), 1e-9);
  EXPECT_LT((ct.grid.origin_ct_mm - Eigen::Vector3d(-40.0, 15.0, 100.0)).norm(), 1e-9);
  EXPECT_LT((ct.grid.direction - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  std::size_t i = 0;
  for (int z = 0; z < 8; ++z) {
    for (int y = 0; y < 4; ++y) {
      for (int x = 0; x < 6; ++x, ++i) EXPECT_EQ(ct.hu[i], x + 10 * y + 100 * z - 1024);
    }
  }
  EXPECT_EQ(ct.name, folder_.path().filename().string());
}

TEST_F(DicomSeries, ObliqueAndDescendingSlicesKeepTheirPlaces) {
  const Eigen::Matrix3d turn = oblique();
  std::vector<DicomFile> files = series(5);
  for (std::size_t i = 0; i < files.size(); ++i) {
    const Eigen::Vector3d position = Eigen::Vector3d(3, 4, 5) - turn.col(2) * (2.5 * static_cast<double>(i));
    for (int k = 0; k < 3; ++k) {
      files[i].position[static_cast<std::size_t>(k)] = position[k];
      files[i].orientation[static_cast<std::size_t>(k)] = turn(k, 0);
      files[i].orientation[static_cast<std::size_t>(k + 3)] = turn(k, 1);
    }
  }
  write(files);
  const Volume ct = readVolume(folder_.path().string(), {}, {});
  // Every file's first pixel is found where the file says: ten digits are written.
  for (std::size_t i = 0; i < files.size(); ++i) {
    const Eigen::Vector3d expected(files[i].position[0], files[i].position[1], files[i].position[2]);
    const auto slice = static_cast<int>(files.size() - 1 - i);
    EXPECT_LT((ct.grid.ctFromIndex() * Eigen::Vector3d(0, 0, slice) - expected).norm(), 1e-6);
    EXPECT_EQ(ct.hu[static_cast<std::size_t>(slice) * 24], 100 * static_cast<int>(i) - 1024);
  }
}

TEST_F(DicomSeries, RescaleOfEachSliceIsItsOwn) {
  std::vector<DicomFile> files = series(3);
  files[1].slope = 2.0;
  files[1].intercept = -500.0;
  write(files);
  const Volume ct = readVolume(folder_.path().string(), {}, {});
  EXPECT_EQ(ct.hu[25], 1 - 1024 + 100 + (2 * 101 - 500) - (101 - 1024));
  EXPECT_EQ(ct.hu[49], 201 - 1024);
}

TEST_F(DicomSeries, TheLargestIsTakenAndAnotherByItsUid) {
  write(series(5, 2.5, "1.2.3.1"), "A");
  write(series(7, 2.0, "1.2.3.2"), "B");
  std::filesystem::create_directory(folder_ / "localizer");
  write(series(1, 2.0, "1.2.3.0"), "localizer/L");
  std::string said;
  const Logger logger = [&said](LogLevel, const std::string& text) { said += text; };
  EXPECT_EQ(readVolume(folder_.path().string(), {}, logger).grid.size.z(), 7);
  expectContains(said, "1.2.3.2");
  expectContains(said, "1.2.3.1 (5 slices)");
  EXPECT_EQ(said.find("SECRET"), std::string::npos);
  EXPECT_EQ(readVolume(folder_.path().string(), ofSeries("1.2.3.1"), {}).grid.size.z(), 5);
  expectContains(refusal(folder_.path().string(), ofSeries("9.9")), "ct/series_uid '9.9' is not there");
  expectContains(refusal(folder_.path().string(), ofSeries("1.2.3.0")), "single slice");
  const auto list = listDicomSeries(folder_.path().string());
  ASSERT_EQ(list.size(), 3U);
  EXPECT_EQ(list[2].uid, "1.2.3.2");
  EXPECT_EQ(list[2].slices, 7U);
}

TEST_F(DicomSeries, MissingSlicesAreFoundAnywhere) {
  for (const std::size_t missing : {std::size_t{1}, std::size_t{4}, std::size_t{8}}) {
    const TemporaryFolder folder;
    std::vector<DicomFile> files = series(10);
    files.erase(files.begin() + static_cast<std::ptrdiff_t>(missing));
    for (std::size_t i = 0; i < files.size(); ++i) writeDicom(folder / (std::to_string(i) + ".dcm"), files[i]);
    const std::string message = refusal(folder.path().string());
    expectContains(message, "slices are missing between");
    expectContains(message, std::to_string(missing - 1) + ".dcm");
    expectContains(message, "5 mm apart where 2.5 mm is usual");
  }
}

TEST_F(DicomSeries, UnevenSpacingIsRefusedAndRoundingIsNot) {
  std::vector<DicomFile> rounded = series(20, 0.75);
  for (auto& file : rounded) file.position[2] = std::round(file.position[2] * 10.0) / 10.0;
  write(rounded);
  EXPECT_NEAR(readVolume(folder_.path().string(), {}, {}).grid.spacing_mm.z(), 0.75, 0.01);

  const TemporaryFolder folder;
  std::vector<DicomFile> uneven = series(10);
  uneven[4].position[2] += 0.3;
  for (std::size_t i = 0; i < uneven.size(); ++i) writeDicom(folder / (std::to_string(i) + ".dcm"), uneven[i]);
  expectContains(refusal(folder.path().string()), "unevenly spaced");
  expectContains(refusal(folder.path().string()), "4.dcm");

  // Half of the slices closer: each gap looks usual, the whole is not.
  const TemporaryFolder two_parts;
  std::vector<DicomFile> parts = series(20, 2.5);
  for (std::size_t i = 10; i < 20; ++i) parts[i].position[2] = parts[9].position[2] + 3.0 * static_cast<double>(i - 9);
  for (std::size_t i = 0; i < parts.size(); ++i) writeDicom(two_parts / (std::to_string(i) + ".dcm"), parts[i]);
  expectContains(refusal(two_parts.path().string()), "unevenly spaced");
}

TEST_F(DicomSeries, GantryTiltIsRefused) {
  std::vector<DicomFile> files = series(10);
  for (std::size_t i = 0; i < files.size(); ++i) files[i].position[1] += 2.5 * std::tan(0.02) * static_cast<double>(i);
  write(files);
  expectContains(refusal(folder_.path().string()), "gantry tilt");
}

TEST_F(DicomSeries, RefusesWhatIsNoVolume) {
  const auto refusalOf = [](const std::vector<DicomFile>& files) {
    const TemporaryFolder folder;
    for (std::size_t i = 0; i < files.size(); ++i) writeDicom(folder / (std::to_string(i) + ".dcm"), files[i]);
    return refusal(folder.path().string());
  };
  expectContains(refusalOf(series(1)), "single slice");
  std::vector<DicomFile> files = series(4);
  files[2].samples_per_pixel = 3;
  expectContains(refusalOf(files), "colour");
  files = series(4);
  files[2].has_position = false;
  expectContains(refusalOf(files), "2.dcm does not state its position");
  files = series(4);
  files[2].position[2] = files[1].position[2];
  expectContains(refusalOf(files), "several slices lie in one place");
  files = series(4);
  files[3].orientation = {1, 0, 0, 0, 0, -1};
  expectContains(refusalOf(files), "oriented otherwise");
  files = series(4);
  files[3].rows = 2;
  files[3].pixels.resize(12);
  expectContains(refusalOf(files), "differs in size");
  files = series(4);
  files[3].pixel_spacing = {0.8, 0.5};
  expectContains(refusalOf(files), "differs in pixel spacing");
}

TEST_F(DicomSeries, OneFileAloneIsRefusedWithAHint) {
  write(series(3));
  expectContains(refusal(folder_ / "I3.dcm"), "name the folder");
}

TEST_F(DicomSeries, OtherFilesAndCopiesInTheFolderDoNotMatter) {
  write(series(4));
  write(series(4), "copy");
  writeBytes(folder_ / "README.txt", "notes\n");
  writeBytes(folder_ / "DICOMDIR", std::string(128, '\0') + "DICMgarbage");
  EXPECT_EQ(readVolume(folder_.path().string(), {}, {}).grid.size.z(), 4);
}

TEST_F(DicomSeries, TruncatedPixelsAreRefused) {
  write(series(4));
  std::filesystem::resize_file(folder_ / "I3.dcm", std::filesystem::file_size(folder_ / "I3.dcm") - 30);
  EXPECT_NE(refusal(folder_.path().string()), "read without an error");
}

TEST_F(DicomSeries, OtherModalitiesAreWarnedOf) {
  std::vector<DicomFile> files = series(4);
  for (auto& file : files) file.modality = "MR";
  write(files);
  std::string warned;
  readVolume(folder_.path().string(), {}, [&warned](LogLevel level, const std::string& text) {
    if (level == LogLevel::kWarning) warned += text;
  });
  expectContains(warned, "'MR', not CT");
}

TEST_F(DicomSeries, LinksOutOfTheDirectoryAreRefused) {
  write(series(4));
  const TemporaryFolder elsewhere;
  std::vector<DicomFile> files = series(5);
  writeDicom(elsewhere / "x.dcm", files[4]);
  std::filesystem::create_symlink(elsewhere / "x.dcm", folder_ / "x.dcm");
  EXPECT_EQ(readVolume(folder_.path().string(), {}, {}).grid.size.z(), 5);
  expectContains(refusal(folder_.path().string(), below(folder_.path().string())), "outside ct/directory");
}

TEST(Folders, EmptyOnesAreRefused) {
  const TemporaryFolder folder;
  expectContains(refusal(folder.path().string()), "no DICOM image");
  EXPECT_TRUE(listDicomSeries(folder.path().string()).empty());
}

// Correlation of `a`, moved by `shift_mm` in the CT frame, with `b` at every fourth voxel of each slice of `a`.
double correlation(const Volume& a, const Volume& b, const Eigen::Vector3d& shift_mm) {
  const Eigen::Affine3d b_from_a =
      b.grid.ctFromIndex().inverse() * Eigen::Translation3d(shift_mm) * a.grid.ctFromIndex();
  double count = 0.0;
  Eigen::Array2d sum = Eigen::Array2d::Zero();
  Eigen::Array2d squares = Eigen::Array2d::Zero();
  double product = 0.0;
  for (int z = 2; z < a.grid.size.z() - 2; ++z) {
    for (int y = 0; y < a.grid.size.y(); y += 4) {
      for (int x = 0; x < a.grid.size.x(); x += 4) {
        const Eigen::Array3i i = (b_from_a * Eigen::Vector3d(x, y, z)).array().round().cast<int>();
        if ((i < 0).any() || (i >= b.grid.size.array()).any()) continue;
        const auto value = [](const Volume& volume, int u, int v, int w) {
          const Eigen::Vector3i& n = volume.grid.size;
          return std::max<double>(volume.hu[(static_cast<std::size_t>(w) * n.y() + v) * n.x() + u], -1000.0);
        };
        const Eigen::Array2d pair(value(a, x, y, z), value(b, i.x(), i.y(), i.z()));
        count += 1.0;
        sum += pair;
        squares += pair * pair;
        product += pair.prod();
      }
    }
  }
  const Eigen::Array2d mean = sum / count;
  return (product / count - mean.prod()) / std::sqrt((squares / count - mean * mean).prod());
}

TEST(RecordedCts, DicomAndNiftiOfOneHeadLieInOneFrame) {
  const char* data = std::getenv("XRAY_REGISTRATION_DATA");
  if (data == nullptr) GTEST_SKIP() << "XRAY_REGISTRATION_DATA names no folder";
  const std::string folder = std::string(data) + "/ct/";
  const Volume dicom = readVolume(folder + "head_phantom_dicom_5mm", {}, {});
  const Volume nifti = readVolume(folder + "head_phantom_0.9mm.nii.gz", {}, {});
  EXPECT_EQ(dicom.grid.size, Eigen::Vector3i(512, 512, 28));
  const double in_place = correlation(dicom, nifti, Eigen::Vector3d::Zero());
  EXPECT_GT(in_place, 0.95);  // The slices differ in thickness.
  for (int axis = 0; axis < 3; ++axis) {
    for (const double shift_mm : {-1.0, 1.0}) {
      EXPECT_LT(correlation(dicom, nifti, shift_mm * Eigen::Vector3d::Unit(axis)), in_place - 0.005) << axis;
    }
  }
}

}  // namespace
}  // namespace xray_registration
