// NIfTI files as other programs leave them: where their voxels lie and what their numbers are.
#include <gtest/gtest.h>
#include <zlib.h>

#include "test/volume/nifti_writer.h"
#include "test/volume/random_damage.h"
#include "test/volume/reading.h"

namespace xray_registration {
namespace {

using reading::expectContains;
using reading::expectPlace;
using reading::read;
using reading::refusal;
using test_files::niftiBytes;
using test_files::NiftiFile;
using test_files::TemporaryFolder;
using test_files::writeBytes;

const Eigen::Vector3d kLastVoxel(3, 2, 1);

class NiftiFiles : public testing::Test {
 protected:
  std::string write(const NiftiFile& file, const std::string& name = "a.nii") const {
    writeBytes(folder_ / name, niftiBytes(file));
    return folder_ / name;
  }

  // Voxels of 2 x 3 x 4 mm along R, A, S from (-10, 20, 30) RAS; the last one lies at (-4, 26, 34) RAS.
  static NiftiFile withSform(int code = 1) {
    NiftiFile file;
    file.sform_code = code;
    file.srow = {{{2, 0, 0, -10}, {0, 3, 0, 20}, {0, 0, 4, 30}}};
    return file;
  }

  // Half a turn about S: the axes run to L, P, S from (10, -20, 30) RAS; the last one lies at (4, -26, 34) RAS.
  static NiftiFile withQform(int code = 1) {
    NiftiFile file;
    file.qform_code = code;
    file.quatern = {0, 0, 1, 10, -20, 30};
    return file;
  }

  TemporaryFolder folder_;
};

TEST_F(NiftiFiles, SformAlone) {
  const auto [ct, warned, said] = read(write(withSform()));
  expectPlace(ct, {0, 0, 0}, {10, -20, 30});
  expectPlace(ct, kLastVoxel, {4, -26, 34});
  EXPECT_EQ(warned, "");
  expectContains(said, "sform (code 1)");
}

TEST_F(NiftiFiles, QformAloneWithBothHands) {
  NiftiFile file = withQform();
  expectPlace(read(write(file)).ct, kLastVoxel, {-4, 26, 34});
  EXPECT_EQ(read(write(file)).warned, "");
  file.pixdim[0] = -1.0;  // qfac: the third axis is turned round.
  expectPlace(read(write(file)).ct, kLastVoxel, {-4, 26, 26});
  file.pixdim[0] = 0.0;  // Stands for 1.
  expectPlace(read(write(file)).ct, kLastVoxel, {-4, 26, 34});
}

TEST_F(NiftiFiles, ObliqueQform) {
  NiftiFile file = withQform();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1.0, -1.0, 2.0).normalized()));
  file.quatern = {turn.x(), turn.y(), turn.z(), 10, -20, 30};
  const Eigen::Vector3d ras = turn * Eigen::Vector3d(6, 6, 4) + Eigen::Vector3d(10, -20, 30);
  expectPlace(read(write(file)).ct, kLastVoxel, {-ras.x(), -ras.y(), ras.z()});
}

TEST_F(NiftiFiles, WhereSformAndQformDisagreeTheSformCountsAndBothAreNamed) {
  for (const int sform_code : {1, 2, 4}) {
    NiftiFile file = withSform(sform_code);
    file.qform_code = 1;
    file.quatern = withQform().quatern;
    const auto [ct, warned, said] = read(write(file));
    expectPlace(ct, kLastVoxel, {4, -26, 34});
    expectContains(warned, "sform (code " + std::to_string(sform_code) + ") and its qform (code 1) disagree by");
    expectContains(warned, "The sform was taken");
  }
}

TEST_F(NiftiFiles, FormsThatAgreeAreNotWarnedOf) {
  NiftiFile file = withQform();
  file.sform_code = 1;
  // Rounded to hundredths of a millimetre.
  file.srow = {{{-2, 0, 0, 10.01}, {0, -3, 0, -20.01}, {0, 0, 4, 30}}};
  const auto [ct, warned, said] = read(write(file));
  EXPECT_EQ(warned, "");
  expectPlace(ct, kLastVoxel, {-4, 26, 34}, 0.02);
}

TEST_F(NiftiFiles, ASformThatScalesOrShearsGivesWayToTheQform) {
  NiftiFile file = withQform();
  file.sform_code = 4;
  file.srow = {{{2.4, 0, 0, -10}, {0, 3.3, 0, 20}, {0, 0, 4.8, 30}}};
  auto [ct, warned, said] = read(write(file));
  expectPlace(ct, kLastVoxel, {-4, 26, 34});
  expectContains(warned, "The qform was taken");
  file.srow = {{{2, 0.5, 0, -10}, {0, 3, 0, 20}, {0, 0, 4, 30}}};
  expectPlace(read(write(file)).ct, kLastVoxel, {-4, 26, 34});
  file.qform_code = 0;
  expectContains(refusal(write(file)), "right angles");
}

TEST_F(NiftiFiles, WithBothCodesZeroTheFormsDoNotCount) {
  NiftiFile file = withSform(0);
  file.quatern = withQform().quatern;
  const auto [ct, warned, said] = read(write(file));
  // x, y, z = pixdim times i, j, k, in RAS.
  expectPlace(ct, {0, 0, 0}, {0, 0, 0});
  expectPlace(ct, kLastVoxel, {-6, -6, 4});
  expectContains(warned, "their codes are 0 and 0");
  expectContains(warned, "ct/orientation");
}

TEST_F(NiftiFiles, PixdimAloneWithAnOrientation) {
  VolumeReadOptions options;
  options.orientation = "LPS";
  auto [ct, warned, said] = read(write(NiftiFile()), options);
  expectPlace(ct, kLastVoxel, {6, 6, 4});
  EXPECT_EQ(warned, "");
  options.orientation = "SAL";
  ct = read(write(NiftiFile()), options).ct;
  expectPlace(ct, kLastVoxel, {4, -6, 6});
  options.orientation = "LRS";
  expectContains(refusal(write(NiftiFile()), options), "ct/orientation is 'LRS'");
  // What the file says stands.
  options.orientation = "LPS";
  expectPlace(read(write(withSform()), options).ct, kLastVoxel, {4, -26, 34});
}

TEST_F(NiftiFiles, UnitsScaleTheOriginToo) {
  const struct {
    int units;
    double factor;
  } cases[] = {{1, 0.001}, {2, 1.0}, {3, 1000.0}, {0, 1.0}, {2 + 8, 1.0}};  // 8: seconds, of a fourth axis.
  for (const auto& [units, factor] : cases) {
    for (const bool has_sform : {true, false}) {
      NiftiFile file = has_sform ? withSform() : withQform();
      file.units = units;
      for (std::size_t i = 1; i < 4; ++i) file.pixdim[i] *= factor;
      for (std::size_t i = 3; i < 6; ++i) file.quatern[i] *= factor;
      for (auto& row : file.srow) {
        for (double& number : row) number *= factor;
      }
      const auto [ct, warned, said] = read(write(file));
      EXPECT_EQ(warned, "");
      expectPlace(ct, kLastVoxel, has_sform ? Eigen::Vector3d(4, -26, 34) : Eigen::Vector3d(-4, 26, 34));
      EXPECT_LT((ct.grid.spacing_mm - Eigen::Vector3d(2, 3, 4)).norm(), 1e-5);
    }
  }
}

TEST_F(NiftiFiles, LengthsThatNoPatientHasAreRefusedUntilTheirUnitIsSaid) {
  NiftiFile file = withSform();
  for (auto& row : file.srow) {
    for (double& number : row) number *= 1000.0;
  }
  for (std::size_t i = 1; i < 4; ++i) file.pixdim[i] *= 1000.0;
  expectContains(refusal(write(file)), "ct/unit_mm");
  VolumeReadOptions options;
  options.unit_mm = 0.001;
  expectPlace(read(write(file), options).ct, kLastVoxel, {4, -26, 34});
}

TEST_F(NiftiFiles, ASlopeOfZeroMeansNoScalingAtAll) {
  NiftiFile file = withSform();
  std::vector<std::int16_t> hu(24, -1000);
  hu[5] = 1234;
  setVoxels(hu, &file);
  file.slope = 0.0;
  file.intercept = -1024.0;
  EXPECT_EQ(read(write(file)).ct.hu, hu);
  file.slope = std::nan("");
  EXPECT_EQ(read(write(file)).ct.hu, hu);
  file.slope = 2.0;
  EXPECT_EQ(read(write(file)).ct.hu[5], 2 * 1234 - 1024);
}

TEST_F(NiftiFiles, BothVersionsInBothByteOrders) {
  for (const int version : {1, 2}) {
    for (const bool big_endian : {false, true}) {
      NiftiFile file = withSform();
      file.version = version;
      file.big_endian = big_endian;
      std::vector<std::int16_t> hu(24);
      for (std::size_t i = 0; i < hu.size(); ++i) hu[i] = static_cast<std::int16_t>(300 * static_cast<int>(i) - 1000);
      setVoxels(hu, &file);
      const auto [ct, warned, said] = read(write(file));
      EXPECT_EQ(ct.hu, hu);
      expectPlace(ct, kLastVoxel, {4, -26, 34});
      expectContains(said, "NIfTI-" + std::to_string(version));
      file.datatype = 16;
      setVoxels(std::vector<float>(hu.begin(), hu.end()), &file);
      EXPECT_EQ(read(write(file)).ct.hu, hu);
    }
  }
}

TEST_F(NiftiFiles, CompressedOrNotWhateverTheName) {
  NiftiFile file = withSform();
  std::vector<std::int16_t> hu(24, -700);
  setVoxels(hu, &file);
  for (const int version : {1, 2}) {
    file.version = version;
    const std::string bytes = niftiBytes(file);
    gzFile packed = gzopen((folder_ / "packed.nii").c_str(), "wb");
    gzwrite(packed, bytes.data(), static_cast<unsigned>(bytes.size()));
    gzclose(packed);
    EXPECT_EQ(read(folder_ / "packed.nii").ct.hu, hu);
    EXPECT_EQ(read(write(file, "plain.nii.gz")).ct.hu, hu);
    EXPECT_EQ(read(write(file, "no_extension")).ct.hu, hu);
  }
}

TEST_F(NiftiFiles, HeaderAndVoxelsInTwoFiles) {
  NiftiFile file = withSform();
  std::vector<std::int16_t> hu(24, -700);
  hu[7] = 55;
  setVoxels(hu, &file);
  std::string header = niftiBytes(file).substr(0, 348);
  header.replace(344, 3, "ni1");
  header.replace(108, 4, std::string(4, '\0'));
  writeBytes(folder_ / "a.hdr", header);
  writeBytes(folder_ / "a.img", file.voxels);
  EXPECT_EQ(read(folder_ / "a.hdr").ct.hu, hu);
  EXPECT_EQ(read(folder_ / "a.img").ct.hu, hu);
  writeBytes(folder_ / "a.img", file.voxels.substr(1));
  expectContains(refusal(folder_ / "a.hdr"), "truncated");
}

TEST_F(NiftiFiles, AnalyzeStatesNoFrameAndIsRefused) {
  std::string bytes = niftiBytes(withSform());
  bytes.replace(344, 3, std::string(3, '\0'));
  writeBytes(folder_ / "a.nii", bytes);
  expectContains(refusal(folder_ / "a.nii"), "Analyze");
}

TEST_F(NiftiFiles, ZeroSpacingIsRefused) {
  for (const int form : {0, 1, 2}) {
    NiftiFile file = form == 0 ? NiftiFile() : form == 1 ? withSform() : withQform();
    file.pixdim[2] = 0.0;
    for (auto& row : file.srow) row[1] = 0.0;
    expectContains(refusal(write(file)), "voxel size that is not positive");
  }
}

TEST_F(NiftiFiles, AHeaderThatClaimsMoreThanTheFileHoldsIsRefused) {
  NiftiFile file = withSform();
  file.size = {1200, 1200, 1200};
  expectContains(refusal(write(file)), "truncated or damaged");
  const std::string bytes = niftiBytes(file);
  gzFile packed = gzopen((folder_ / "packed.nii.gz").c_str(), "wb");
  gzwrite(packed, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(packed);
  // Said of the size, not met while unpacking.
  expectContains(refusal(folder_ / "packed.nii.gz"), "its header claims 3456");
  file.version = 2;
  file.size = {1 << 20, 1 << 20, 1 << 20};
  expectContains(refusal(write(file)), "impossible number of voxels");
}

TEST_F(NiftiFiles, DamagedHeadersAreReadOrRefused) {
  for (const int version : {1, 2}) {
    NiftiFile file = withSform();
    file.version = version;
    const std::string path = write(file);
    reading::expectDamageIsReadOrRefused(path, path, version == 1 ? 352 : 544);
  }
}

TEST_F(NiftiFiles, ADamagedByteInCompressedDataIsFound) {
  NiftiFile file = withSform();
  file.size = {40, 40, 40};
  std::vector<std::int16_t> hu(64000);
  unsigned noise = 1;
  for (auto& value : hu) value = static_cast<std::int16_t>((noise = noise * 1664525U + 1013904223U) >> 20U);
  setVoxels(hu, &file);
  std::string bytes = niftiBytes(file);
  gzFile packed = gzopen((folder_ / "a.nii.gz").c_str(), "wb0");  // Stored: a changed byte still unpacks.
  gzwrite(packed, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(packed);
  std::ifstream stream(folder_ / "a.nii.gz", std::ios::binary);
  std::string raw((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  raw[raw.size() / 2] = static_cast<char>(raw[raw.size() / 2] ^ 1);
  writeBytes(folder_ / "a.nii.gz", raw);
  expectContains(refusal(folder_ / "a.nii.gz"), "check sum");
}

}  // namespace
}  // namespace xray_registration
