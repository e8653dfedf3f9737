// Files of every format whose headers or numbers cannot be right: refused by name, with what to do, before memory is
// taken.
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <functional>
#include <limits>

#include "test/common/address_space.h"
#include "test/volume/nifti_writer.h"
#include "test/volume/reading.h"
#include "test/volume/test_files.h"

namespace xray_registration {
namespace {

using test_files::bytesOf;
using test_files::DicomFile;
using test_files::NiftiFile;
using test_files::TemporaryFolder;
using test_files::writeBytes;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string gzipped(const std::string& bytes) {
  const TemporaryFolder folder;
  gzFile file = gzopen((folder / "a.gz").c_str(), "wb");
  gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(file);
  std::ifstream stream(folder / "a.gz", std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::string textOf(double number) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << number;
  return text.str();
}

/// A small volume that is right but for what a test changes: spacing, axes, and numbers (of floats).
struct Stated {
  std::array<int, 3> size{4, 3, 2};
  std::array<double, 3> spacing{2.0, 3.0, 4.0};
  std::array<std::array<double, 3>, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< Of the voxels, unit vectors.
  std::vector<float> voxels = std::vector<float>(24, -700.0F);
};

NiftiFile niftiOf(const Stated& stated) {
  NiftiFile file;
  file.datatype = 16;
  file.voxels = bytesOf(stated.voxels);
  file.sform_code = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    file.size[i] = stated.size[i];
    file.pixdim[i + 1] = stated.spacing[i];
    for (std::size_t row = 0; row < 3; ++row) file.srow[row][i] = stated.axes[i][row] * stated.spacing[i];
  }
  return file;
}

std::string sizesOf(const Stated& stated) {
  return std::to_string(stated.size[0]) + " " + std::to_string(stated.size[1]) + " " + std::to_string(stated.size[2]);
}

std::string nrrdHeader(const Stated& stated, const std::string& encoding, const std::string& more = "") {
  std::string header = "NRRD0004\ntype: float\ndimension: 3\nsizes: " + sizesOf(stated) +
                       "\nspace: left-posterior-superior\nspace directions:";
  for (std::size_t i = 0; i < 3; ++i) {
    header += " (";
    for (std::size_t j = 0; j < 3; ++j) header += (j > 0 ? "," : "") + textOf(stated.axes[i][j] * stated.spacing[i]);
    header += ")";
  }
  return header + "\nspace origin: (1,2,3)\nendian: little\nencoding: " + encoding + "\n" + more + "\n";
}

std::string metaHeader(const Stated& stated, const std::string& more = "", const std::string& data = "LOCAL") {
  std::string header = "ObjectType = Image\nNDims = 3\n" + more + "TransformMatrix =";
  for (const auto& axis : stated.axes) {
    for (const double component : axis) header += " " + textOf(component);
  }
  header += "\nOffset = 1 2 3\nElementSpacing =";
  for (const double spacing : stated.spacing) header += " " + textOf(spacing);
  return header + "\nDimSize = " + sizesOf(stated) + "\nElementType = MET_FLOAT\nElementDataFile = " + data + "\n";
}

/// A kind of file and how it is written; what is to be read.
struct Format {
  const char* name;
  std::function<std::string(const TemporaryFolder&, const Stated&)> write;
};

std::string written(const TemporaryFolder& folder, const std::string& name, const std::string& bytes) {
  writeBytes(folder / name, bytes);
  return folder / name;
}

std::string detachedNifti(const TemporaryFolder& folder, const Stated& stated) {
  std::string header = niftiBytes(niftiOf(stated)).substr(0, 348);
  header.replace(344, 3, "ni1");
  header.replace(108, 4, std::string(4, '\0'));
  writeBytes(folder / "a.img", bytesOf(stated.voxels));
  return written(folder, "a.hdr", header);
}

const std::vector<Format>& fileFormats() {
  static const std::vector<Format> formats = {
      {"NIfTI-1", [](const auto& f, const auto& s) { return written(f, "a.nii", niftiBytes(niftiOf(s))); }},
      {"NIfTI-2",
       [](const auto& f, const auto& s) {
         NiftiFile file = niftiOf(s);
         file.version = 2;
         return written(f, "a.nii", niftiBytes(file));
       }},
      {"NIfTI gz",
       [](const auto& f, const auto& s) { return written(f, "a.nii.gz", gzipped(niftiBytes(niftiOf(s)))); }},
      {"NIfTI in two files", detachedNifti},
      {"NRRD",
       [](const auto& f, const auto& s) { return written(f, "a.nrrd", nrrdHeader(s, "raw") + bytesOf(s.voxels)); }},
      {"NRRD gzip",
       [](const auto& f, const auto& s) {
         return written(f, "a.nrrd", nrrdHeader(s, "gzip") + gzipped(bytesOf(s.voxels)));
       }},
      {"NRRD text",
       [](const auto& f, const auto& s) {
         std::string text;
         for (const float voxel : s.voxels) text += textOf(voxel) + "\n";
         return written(f, "a.nrrd", nrrdHeader(s, "ascii") + text);
       }},
      {"NRRD detached",
       [](const auto& f, const auto& s) {
         writeBytes(f / "a.raw", bytesOf(s.voxels));
         return written(f, "a.nhdr", nrrdHeader(s, "raw", "data file: a.raw\n"));
       }},
      {"NRRD in parts",
       [](const auto& f, const auto& s) {
         const std::string bytes = bytesOf(s.voxels);
         writeBytes(f / "a.raw", bytes.substr(0, bytes.size() / 2));
         writeBytes(f / "b.raw", bytes.substr(bytes.size() / 2));
         return written(
             f, "a.nhdr",
             nrrdHeader(s, "raw").substr(0, nrrdHeader(s, "raw").size() - 1) + "data file: LIST\na.raw\nb.raw\n");
       }},
      {"MetaImage",
       [](const auto& f, const auto& s) { return written(f, "a.mha", metaHeader(s) + bytesOf(s.voxels)); }},
      {"MetaImage compressed",
       [](const auto& f, const auto& s) {
         return written(f, "a.mha", metaHeader(s, "CompressedData = True\n") + gzipped(bytesOf(s.voxels)));
       }},
      {"MetaImage in two files",
       [](const auto& f, const auto& s) {
         writeBytes(f / "a.raw", bytesOf(s.voxels));
         return written(f, "a.mhd", metaHeader(s, "", "a.raw"));
       }},
  };
  return formats;
}

/// Of what is no volume of labels either.
std::string refusalOfLabels(const std::string& path) {
  try {
    readLabels(path, {}, {});
  } catch (const VolumeError& error) {
    return error.what();
  }
  return "read without an error";
}

void expectRefused(const std::string& said, const std::string& path, const std::vector<std::string>& any_of) {
  // A detached header or its voxels.
  EXPECT_NE(said.find((std::filesystem::path(path).parent_path() / "a.").string()), std::string::npos) << said;
  EXPECT_EQ(said.find('\n'), std::string::npos) << said;
  EXPECT_TRUE(std::any_of(any_of.begin(), any_of.end(), [&said](const std::string& words) {
    return said.find(words) != std::string::npos;
  })) << said;
}

TEST(ImpossibleFiles, TheseFormatsAreReadWhenNothingIsWrong) {
  for (const Format& format : fileFormats()) {
    SCOPED_TRACE(format.name);
    const TemporaryFolder folder;
    EXPECT_EQ(reading::read(format.write(folder, Stated())).ct.hu, std::vector<std::int16_t>(24, -700));
  }
}

TEST(ImpossibleFiles, AClaimThatTheFileCannotHoldIsRefusedBeforeMemoryIsTaken) {
  Stated stated;
  stated.size = {1200, 1200, 1200};  // 6.9 GB
  for (const Format& format : fileFormats()) {
    SCOPED_TRACE(format.name);
    const TemporaryFolder folder;
    const std::string path = format.write(folder, stated);
    const AddressSpaceLimit limit(std::size_t{256} << 20U);
    for (const std::string& said : {reading::refusal(path), refusalOfLabels(path)}) {
      expectRefused(said, path, {"truncated or damaged", "expected 1200 filenames"});
    }
  }
}

TEST(ImpossibleFiles, ASpacingThatNothingHasIsRefused) {
  for (const double spacing : {0.0, -2.0, kNan, kInfinity, 1e-30, 1e30}) {
    for (const Format& format : fileFormats()) {
      SCOPED_TRACE(std::string(format.name) + ", " + textOf(spacing));
      Stated stated;
      stated.spacing[1] = spacing;
      if (spacing < 1e-3 && spacing > 0.0) stated.spacing = {spacing, spacing, spacing};
      // There the sign is an axis' direction.
      if (spacing < 0.0 && std::string(format.name).rfind("MetaImage", 0) != 0) continue;
      const TemporaryFolder folder;
      const std::string path = format.write(folder, stated);
      expectRefused(reading::refusal(path), path,
                    {"voxel size that is not positive", "as its voxel size", "ct/unit_mm", "no direction in space",
                     "its header cannot be read"});
    }
  }
}

TEST(ImpossibleFiles, AxesThatSpanNoSpaceAreRefused) {
  const struct {
    const char* name;
    std::array<std::array<double, 3>, 3> axes;
  } cases[] = {{"two are the same", {{{1, 0, 0}, {1, 0, 0}, {0, 0, 1}}}},
               {"in a plane", {{{1, 0, 0}, {0, 1, 0}, {0.6, 0.8, 0}}}},
               {"no number", {{{1, 0, 0}, {0, kNan, 0}, {0, 0, 1}}}}};
  for (const auto& [name, axes] : cases) {
    for (const Format& format : fileFormats()) {
      SCOPED_TRACE(std::string(format.name) + ", " + name);
      Stated stated;
      stated.axes = axes;
      const TemporaryFolder folder;
      const std::string path = format.write(folder, stated);
      expectRefused(reading::refusal(path), path,
                    {"right angles", "holds no axes", "its header cannot be read", "as a direction of its axes",
                     "no direction in space"});
    }
  }
}

TEST(ImpossibleFiles, NumbersThatNoCtHasAreRefused) {
  const float huge[] = {1e30F, -1e30F, 1e38F, std::numeric_limits<float>::quiet_NaN(),
                        std::numeric_limits<float>::infinity()};
  for (const float number : huge) {
    for (const Format& format : fileFormats()) {
      SCOPED_TRACE(std::string(format.name) + ", " + textOf(number));
      Stated stated;
      stated.voxels.assign(24, number);
      const TemporaryFolder folder;
      const std::string path = format.write(folder, stated);
      expectRefused(reading::refusal(path), path, {"no Hounsfield units", "none of its voxels holds a number"});
      expectRefused(refusalOfLabels(path), path, {"labels are whole numbers", "none of its voxels holds a number"});
    }
  }
}

TEST(ImpossibleFiles, ACtIsNoLabelImage) {
  const TemporaryFolder folder;
  Stated stated;
  stated.voxels[3] = -1000.0F;
  const std::string path = fileFormats().front().write(folder, stated);
  expectRefused(refusalOfLabels(path), path, {"Is it the CT"});
}

TEST(ImpossibleFiles, PartsThatNobodyHasNamedOneByOne) {
  const TemporaryFolder folder;
  const std::string pattern = written(folder, "a.nhdr", nrrdHeader(Stated(), "raw", "data file: a%03d.raw 1 2 1\n"));
  writeBytes(folder / "a001.raw", bytesOf(std::vector<float>(12)));
  writeBytes(folder / "a002.raw", bytesOf(std::vector<float>(12)));
  expectRefused(reading::refusal(pattern), pattern, {"named by a pattern; write it as one .nrrd"});
  const std::string packed = written(folder, "a.nrrd", nrrdHeader(Stated(), "bzip2") + "BZh9");
  expectRefused(reading::refusal(packed), packed, {"write it with gzip", "its header cannot be read"});
}

/// Slices of a series in which each file states what the test makes of it.
class ImpossibleDicom : public testing::Test {
 protected:
  std::string refusalOf(const std::function<void(DicomFile*)>& change, bool is_packed = false) const {
    for (int i = 0; i < 3; ++i) {
      DicomFile file;
      file.instance_uid = "1.2.3.1." + std::to_string(i + 1);
      file.position = {0.0, 0.0, 2.0 * i};
      file.rows = file.columns = 8;
      file.pixels.assign(64, 400);
      change(&file);
      const std::string name = std::to_string(i) + ".dcm";
      test_files::writeDicom(folder_ / name, file);
      if (is_packed) pack(folder_ / name);
    }
    const AddressSpaceLimit limit(std::size_t{256} << 20U);
    return reading::refusal(folder_.path().string());
  }

  /// As if its pixels were run lengths, which may be few.
  static void pack(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    const std::string syntax = "1.2.840.10008.1.2.1";
    bytes.replace(bytes.find(syntax), syntax.size(), "1.2.840.10008.1.2.5");
    writeBytes(path, bytes);
  }

  TemporaryFolder folder_;
};

TEST_F(ImpossibleDicom, IsReadWhenNothingIsWrong) {
  EXPECT_EQ(refusalOf([](DicomFile*) {}), "read without an error");
}

TEST_F(ImpossibleDicom, AClaimThatTheFileCannotHold) {
  for (const bool is_packed : {false, true}) {
    const std::string said = refusalOf([](DicomFile* file) { file->rows = file->columns = 65535; }, is_packed);
    EXPECT_NE(said.find("truncated or damaged"), std::string::npos) << said;
  }
}

TEST_F(ImpossibleDicom, LengthsAndAxesThatNothingHas) {
  const std::array<double, 6> flat{1, 0, 0, 1, 0, 0};
  const std::array<double, 6> none{0, 0, 0, 0, 0, 0};
  const std::array<double, 6> no_number{1, 0, 0, 0, kNan, 0};
  for (const double spacing : {0.0, -1.0, kNan, kInfinity, 1e30, 1e-30}) {
    const std::string said = refusalOf([=](DicomFile* file) { file->pixel_spacing = {spacing, spacing}; });
    EXPECT_NE(said.find(folder_.path().filename().string()), std::string::npos) << said;
    EXPECT_NE(said, "read without an error") << spacing;
  }
  for (const auto& orientation : {flat, none, no_number}) {
    const std::string said = refusalOf([&](DicomFile* file) { file->orientation = orientation; });
    EXPECT_TRUE(said.find("right angles") != std::string::npos || said.find("does not state") != std::string::npos)
        << said;
  }
  const std::string said = refusalOf([](DicomFile* file) { file->position[2] = kNan; });
  EXPECT_NE(said.find("does not state its position"), std::string::npos) << said;
}

TEST_F(ImpossibleDicom, ValuesThatNoCtHas) {
  for (const double slope : {1e30, -1e30}) {
    const std::string said = refusalOf([=](DicomFile* file) { file->slope = slope; });
    EXPECT_NE(said.find("no Hounsfield units"), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace xray_registration
