#include <NrrdIO.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <sstream>

#include "byte_stream.h"
#include "file_boundary.h"
#include "file_grid.h"
#include "header_text.h"
#include "nrrd_header.h"
#include "xray_registration/volume/volume_error.h"

// The format: "Definition of NRRD File Format", teem.sourceforge.net/nrrd/format.html.

namespace xray_registration {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw VolumeError("'" + path + "': " + what);
}

struct NukeNrrd {
  void operator()(Nrrd* nrrd) const { nrrdNuke(nrrd); }
};
struct NixIoState {
  void operator()(NrrdIoState* state) const { nrrdIoStateNix(state); }
};
struct FreeText {
  void operator()(char* text) const {
    std::free(text);  // NOLINT(cppcoreguidelines-no-malloc,cppcoreguidelines-owning-memory): a C library's text.
  }
};

struct LoadedHeader {
  std::unique_ptr<Nrrd, NukeNrrd> nrrd{nrrdNew()};
  std::unique_ptr<NrrdIoState, NixIoState> state{nrrdIoStateNew()};
};

LoadedHeader loaded(const std::string& path) {
  LoadedHeader header;
  header.state->skipData = 1;
  if (nrrdLoad(header.nrrd.get(), path.c_str(), header.state.get()) != 0) {
    const std::unique_ptr<char, FreeText> said(biffGetDone(NRRD));
    // The last line is the cause; those before it say where in the library it was noticed.
    std::string text = said ? said.get() : "";
    while (!text.empty() && text.back() == '\n') text.pop_back();
    refuse(path, "its header cannot be read: " + text.substr(text.rfind('\n') + 1));
  }
  return header;
}

// The file of the voxels; empty when there are several.
std::string dataFile(const NrrdIoState& state, const std::string& path) {
  if (state.dataFNFormat != nullptr || state.dataFNArr->len > 1) return "";
  if (state.dataFNArr->len == 0) return path;
  return (fs::path(path).parent_path() / state.dataFN[0]).string();
}

/// As the library understood the header.
void checkDataFiles(const NrrdIoState& state, const std::string& path, const FileRule& rule) {
  if (rule.directory.empty()) return;
  if (state.dataFNFormat != nullptr || state.dataFNArr->len > 1) {
    refuse(path, "it refers to several files, which are not read while ct/directory is set");
  }
  checkReferred(path, dataFile(state, path), rule.directory);
}

double sizeOf(const std::string& file, const std::string& path) {
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error) refuse(path, "the file of its voxels, '" + file + "', cannot be opened: " + error.message());
  return static_cast<double>(size);
}

// Voxels in several files, which are named one by one.
void checkClaimOfParts(const NrrdIoState& state, const std::string& path, double bytes) {
  if (state.dataFNFormat != nullptr) {
    refuse(path, "its voxels lie in files that are named by a pattern; write it as one .nrrd");
  }
  double size = 0.0;
  for (unsigned i = 0; i < state.dataFNArr->len; ++i) {
    size += sizeOf((fs::path(path).parent_path() / state.dataFN[i]).string(), path);
  }
  constexpr double kLargestDeflateRatio = 1032.0;  // As of byte_stream.cpp.
  if (state.encoding == nrrdEncodingGzip) size *= kLargestDeflateRatio;
  if (size < bytes) refuse(path, "the files of its voxels are truncated or damaged: they end before the last voxel");
}

void checkClaim(const Nrrd& nrrd, const NrrdIoState& state, const std::string& path) {
  double voxels = 1.0;
  for (unsigned i = 0; i < nrrd.dim; ++i) voxels *= static_cast<double>(nrrd.axis[i].size);
  const double bytes = voxels * static_cast<double>(nrrdElementSize(&nrrd));
  if (state.encoding == nrrdEncodingBzip2) refuse(path, "its voxels are packed with bzip2; write it with gzip");
  const std::string file = dataFile(state, path);
  if (file.empty()) return checkClaimOfParts(state, path, bytes);
  const double size = sizeOf(file, path);
  if (state.encoding == nrrdEncodingGzip) return checkDeflateClaim(path, file, bytes);
  const double before = static_cast<double>(std::max(0L, state.byteSkip));
  // As text a voxel takes a digit and a blank at least.
  const double needed = state.encoding == nrrdEncodingAscii ? 2.0 * voxels - 1.0 : before + bytes;
  if (size < needed) refuse(path, "the file is truncated or damaged: it ends before its last voxel");
}

// Millimetres of a unit that is named in a header; 0 for one that is not known.
double unitNamed(const std::string& name) {
  const std::string unit = lowerCase(name);
  for (const char* one : {"mm", "millimeter", "millimeters", "millimetre", "millimetres"}) {
    if (unit == one) return 1.0;
  }
  for (const char* one : {"um", "\xc2\xb5m", "\xce\xbcm", "micron", "microns", "micrometer", "micrometers",
                          "micrometre", "micrometres"}) {
    if (unit == one) return 0.001;
  }
  for (const char* one : {"cm", "centimeter", "centimeters", "centimetre", "centimetres"}) {
    if (unit == one) return 10.0;
  }
  for (const char* one : {"m", "meter", "meters", "metre", "metres"}) {
    if (unit == one) return 1000.0;
  }
  return 0.0;
}

std::string textOf(const char* text) { return text == nullptr ? "" : text; }

// One unit for all axes, as the header names it.
double unitOf(const Nrrd& nrrd, const std::vector<unsigned>& axes, const std::string& path,
              std::vector<std::string>* warnings) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const std::string name = textOf(nrrd.spaceDim > 0 ? nrrd.spaceUnits[i] : nrrd.axis[axes[i]].units);
    if (!name.empty()) names.push_back(name);
  }
  if (names.empty()) return 1.0;
  if (std::any_of(names.begin(), names.end(), [&names](const std::string& name) { return name != names.front(); })) {
    refuse(path, "its axes have different units, '" + names.front() + "' and '" + names.back() +
                     "'; say in ct/unit_mm how many millimetres all of them have, or write it in millimetres");
  }
  const double unit_mm = unitNamed(names.front());
  if (unit_mm > 0.0) return unit_mm;
  warnings->push_back("its unit of length, '" + names.front() +
                      "', is not known and taken as millimetres; ct/unit_mm says otherwise");
  return 1.0;
}

// Where x, y and z of its space point; empty when the header does not say.
std::string lettersOf(int space) {
  switch (space) {
    case nrrdSpaceRightAnteriorSuperior:
      return "RAS";
    case nrrdSpaceLeftAnteriorSuperior:
      return "LAS";
    case nrrdSpaceLeftPosteriorSuperior:
    case nrrdSpaceScannerXYZ:
      return "LPS";
    default:
      return "";
  }
}

void readSpaceAxis(const NrrdAxisInfo& axis, std::size_t i, FileGrid* grid) {
  double square = 0.0;
  for (std::size_t j = 0; j < 3; ++j) square += axis.spaceDirection[j] * axis.spaceDirection[j];
  grid->spacing_mm[i] = std::sqrt(square);
  for (std::size_t j = 0; j < 3; ++j) grid->axes[i][j] = axis.spaceDirection[j] / grid->spacing_mm[i];
}

// An axis along x, y or z; returns whether its spacing is stated.
bool readPlainAxis(const NrrdAxisInfo& axis, std::size_t i, FileGrid* grid) {
  const double steps = static_cast<double>(axis.size) - (axis.center == nrrdCenterCell ? 0.0 : 1.0);
  double spacing = axis.spacing;
  if (!std::isfinite(spacing)) spacing = (axis.max - axis.min) / steps;
  const bool is_stated = std::isfinite(spacing);
  if (!is_stated) spacing = 1.0;
  grid->axes[i] = {};
  grid->axes[i][i] = spacing < 0.0 ? -1.0 : 1.0;
  grid->spacing_mm[i] = std::abs(spacing);
  const double first = std::isfinite(axis.min) ? axis.min : 0.0;
  grid->origin_mm[i] = first + (axis.center == nrrdCenterCell && std::isfinite(axis.min) ? 0.5 * spacing : 0.0);
  return is_stated;
}

void readPlace(const Nrrd& nrrd, const std::vector<unsigned>& axes, FileGrid* grid,
               std::vector<std::string>* warnings) {
  bool has_spacing = true;
  for (std::size_t i = 0; i < 3; ++i) {
    const NrrdAxisInfo& axis = nrrd.axis[axes[i]];
    grid->size[i] = static_cast<int>(std::min<std::size_t>(axis.size, 1U << 30U));
    if (nrrd.spaceDim == 3) {
      readSpaceAxis(axis, i, grid);
      grid->origin_mm[i] = std::isfinite(nrrd.spaceOrigin[i]) ? nrrd.spaceOrigin[i] : 0.0;
    } else {
      has_spacing = readPlainAxis(axis, i, grid) && has_spacing;
    }
  }
  if (!has_spacing) warnings->push_back("it states no voxel size; 1 mm is taken");
  if (nrrd.spaceDim == 3 && !std::isfinite(nrrd.spaceOrigin[0])) {
    warnings->push_back("it states no space origin; the first voxel is taken to lie at 0, 0, 0");
  }
}

std::vector<unsigned> spatialAxes(const Nrrd& nrrd, const std::string& path) {
  std::array<unsigned, NRRD_DIM_MAX> found{};
  const unsigned count = nrrdDomainAxesGet(&nrrd, found.data());
  std::vector<unsigned> axes(found.begin(), found.begin() + count);
  if (nrrd.spaceDim > 0) {
    axes.erase(std::remove_if(axes.begin(), axes.end(),
                              [&nrrd](unsigned i) { return !std::isfinite(nrrd.axis[i].spaceDirection[0]); }),
               axes.end());
  }
  if (axes.size() > 3 || nrrd.spaceDim > 3) {
    refuse(path, "it has more than three dimensions; take one volume out of it");
  }
  if (axes.size() < 3 || (nrrd.spaceDim > 0 && nrrd.spaceDim < 3)) {
    refuse(path, "it holds a single slice, or its axes have no direction in space; a CT volume has three");
  }
  return axes;
}

}  // namespace

NrrdHeader readNrrdHeader(const std::string& path, const FileRule& rule) {
  const LoadedHeader loaded_header = loaded(path);
  const Nrrd& nrrd = *loaded_header.nrrd;
  checkDataFiles(*loaded_header.state, path, rule);
  const std::vector<unsigned> axes = spatialAxes(nrrd, path);
  NrrdHeader header;
  readPlace(nrrd, axes, &header.grid, &header.warnings);
  std::string letters = nrrd.spaceDim > 0 ? lettersOf(nrrd.space) : "";
  header.orientation = letters.empty() ? "no space" : "space " + letters;
  if (letters.empty()) {
    letters = rule.orientation.empty() ? "LPS" : rule.orientation;
    header.orientation += ", as " + letters;
    if (rule.orientation.empty()) {
      header.warnings.push_back(
          "it does not say where its axes point (no 'space' that names them). x, y and z are taken to run to the left, "
          "back and head (LPS); if that is wrong, left may be right. ct/orientation says how they run");
    }
  }
  const double unit_mm = rule.unit_mm > 0.0 ? rule.unit_mm : unitOf(nrrd, axes, path, &header.warnings);
  turnToLps(letters, &header.grid);
  checkGrid(header.grid, path);
  checkClaim(nrrd, *loaded_header.state, path);
  scaleLengths(unit_mm, path, &header.grid);
  return header;
}

}  // namespace xray_registration
