// Says what is understood of a CT, so that somebody can compare it with what they know of it.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "tools/common/command_line.h"
#include "tools/common/ct_options.h"
#include "tools/common/image_files.h"
#include "tools/inspect_ct/planes.h"
#include "xray_registration/volume/hu_landmarks.h"
#include "xray_registration/volume/volume_io.h"

namespace {

using namespace xray_registration;
using namespace xray_registration::tools;

struct Arguments {
  std::string ct;
  std::string picture;
  VolumeReadOptions read;
};

/// A CT and what was said while it was read.
struct ReadCt {
  Volume ct;
  std::vector<std::string> notes;
  std::vector<std::string> warnings;
};

ReadCt readCt(const Arguments& arguments, bool check_values) {
  VolumeReadOptions options = arguments.read;
  options.check_values = check_values;
  ReadCt result;
  result.ct = readVolume(arguments.ct, options, [&result](LogLevel level, const std::string& text) {
    (level == LogLevel::kWarning || level == LogLevel::kError ? result.warnings : result.notes).push_back(text);
  });
  return result;
}

/// "to the left", and by how much it is turned away when it is.
std::string directionInWords(const Eigen::Vector3d& axis) {
  constexpr const char* kSides[3][2] = {{"left", "right"}, {"back", "front"}, {"head", "feet"}};
  int largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  std::string words = std::string("to the ") + kSides[largest][axis[largest] < 0.0 ? 1 : 0];
  const double degrees = std::acos(std::min(1.0, std::abs(axis[largest]))) * 180.0 / M_PI;
  if (degrees < 0.1) return words;
  char text[100];
  std::snprintf(text, sizeof(text), "%s, turned by %.1f degrees (%.4f, %.4f, %.4f)", words.c_str(), degrees, axis.x(),
                axis.y(), axis.z());
  return text;
}

void printGrid(const VolumeGrid& grid) {
  const Eigen::Vector3d extent_mm = grid.spacing_mm.cwiseProduct(grid.size.cast<double>());
  const Eigen::Vector3d centre_mm = grid.centreCt();
  std::printf("size:      %d x %d x %d voxels\n", grid.size.x(), grid.size.y(), grid.size.z());
  std::printf("spacing:   %.4f x %.4f x %.4f mm\n", grid.spacing_mm.x(), grid.spacing_mm.y(), grid.spacing_mm.z());
  std::printf("extent:    %.1f x %.1f x %.1f mm\n", extent_mm.x(), extent_mm.y(), extent_mm.z());
  for (int axis = 0; axis < 3; ++axis) {
    std::printf("axis %c:    %s\n", "ijk"[axis], directionInWords(grid.direction.col(axis)).c_str());
  }
  if (grid.direction.determinant() < 0.0) std::printf("           (left-handed, which is in order)\n");
  std::printf("origin:    %.3f, %.3f, %.3f mm (LPS; centre of the first voxel)\n", grid.origin_ct_mm.x(),
              grid.origin_ct_mm.y(), grid.origin_ct_mm.z());
  std::printf("centre:    %.3f, %.3f, %.3f mm (LPS)\n", centre_mm.x(), centre_mm.y(), centre_mm.z());
}

std::string peakInWords(const std::optional<int>& peak_hu) {
  return peak_hu ? ", most of it " + std::to_string(*peak_hu) + " HU" : "";
}

void printLandmarks(const HuLandmarks& marks) {
  std::printf("values:    %d to %d HU but for a thousandth at either end\n", marks.low_hu, marks.high_hu);
  std::printf("  air          %5.1f %%%s\n", 100.0 * marks.air_share, peakInWords(marks.air_hu).c_str());
  std::printf("  soft tissue  %5.1f %%%s\n", 100.0 * marks.soft_tissue_share,
              peakInWords(marks.soft_tissue_hu).c_str());
  std::printf("  bone         %5.1f %%  (200 to 2500 HU)\n", 100.0 * marks.bone_share);
  std::printf("  denser       %5.1f %%\n", 100.0 * marks.metal_share);
}

void printSeries(const std::string& path) {
  if (!std::filesystem::is_directory(path)) return;
  for (const SeriesInfo& series : listDicomSeries(path)) {
    std::printf("series:    %s (%zu %s)\n", onOneLine(series.uid).c_str(), series.slices,
                series.slices == 1 ? "slice" : "slices");
  }
}

void report(const Arguments& arguments, const ReadCt& read) {
  for (const std::string& note : read.notes) std::printf("%s\n", onOneLine(note).c_str());
  printSeries(arguments.ct);
  printGrid(read.ct.grid);
  printLandmarks(huLandmarks(read.ct));
  for (const std::string& warning : read.warnings) std::printf("warning:   %s\n", onOneLine(warning).c_str());
  if (!arguments.picture.empty()) writePng(arguments.picture, threePlanes(read.ct));
}

void run(const Arguments& arguments) {
  if (!arguments.picture.empty()) requireWritableParent(arguments.picture, "--picture");
  std::optional<VolumeError> refusal;
  std::optional<ReadCt> read;
  try {
    read = readCt(arguments, arguments.read.check_values);
  } catch (const VolumeError& error) {
    refusal = error;
  }
  // What is refused for its values is shown all the same.
  if (refusal) read = readCt(arguments, false);
  report(arguments, *read);
  if (refusal) throw VolumeError(*refusal);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Prints what is understood of a CT: size, spacing, axes, Hounsfield units, DICOM series, and all warnings. Exit "
      "code 1 when it would be refused.",
      "inspect_ct");
  app.add_option("FILE", arguments.ct, "NIfTI, NRRD, MetaImage or a DICOM folder")
      ->required()
      ->check(CLI::ExistingPath);
  app.add_option("--picture", arguments.picture, "PNG of the three planes through its middle");
  addCtReadOptions(app, &arguments.read);
  return runTool(app, argc, argv, [&] { run(arguments); });
}
