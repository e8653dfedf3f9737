#include <map>
#include <utility>

#include "header_text.h"
#include "mesh_readers.h"
#include "mesh_scanner.h"

// Legacy VTK files, dataset POLYDATA ("VTK File Formats", Kitware). Binary numbers are big endian. Before version 5.1
// cells are lists of a count and its indices; since then they are offsets into a list of indices.

namespace xray_registration {
namespace {

constexpr std::uint64_t kLargestIndex = 0xfffffffe;

NumberType typeOf(const std::string& name, const std::string& path) {
  static const std::map<std::string, NumberType> types = {
      {"char", NumberType::kInt8},          {"unsigned_char", NumberType::kUint8},
      {"short", NumberType::kInt16},        {"unsigned_short", NumberType::kUint16},
      {"int", NumberType::kInt32},          {"unsigned_int", NumberType::kUint32},
      {"long", NumberType::kInt64},         {"unsigned_long", NumberType::kUint64},
      {"vtktypeint64", NumberType::kInt64}, {"vtktypeint32", NumberType::kInt32},
      {"vtkidtype", NumberType::kInt32},    {"float", NumberType::kFloat},
      {"double", NumberType::kDouble}};
  const auto found = types.find(lowerCase(name));
  if (found == types.end()) refuseMesh(path, "it has numbers of the unknown type '" + name.substr(0, 20) + "'");
  return found->second;
}

class VtkReader {
 public:
  VtkReader(const std::string& bytes, const std::string& path) : scanner_(bytes, path), path_(path) {}

  SurfaceMesh read() {
    readHeader();
    for (std::string word = lowerCase(scanner_.word()); !word.empty(); word = lowerCase(scanner_.word())) {
      if (word == "points") {
        readPoints();
      } else if (word == "polygons" || word == "triangle_strips" || word == "lines" || word == "vertices") {
        readCells(word);
      } else if (word == "metadata") {
        scanner_.line();
        while (!scanner_.atEnd() && !scanner_.line().empty()) {
        }
      } else {
        break;  // What follows belongs to points and cells: colours, normals.
      }
    }
    return std::move(mesh_);
  }

 private:
  void readHeader() {
    scanner_.line();
    scanner_.line();
    const std::string encoding = lowerCase(scanner_.word());
    if (encoding != "ascii" && encoding != "binary")
      refuseMesh(path_, "its VTK header states neither ASCII nor BINARY");
    if (lowerCase(scanner_.word()) != "dataset" || lowerCase(scanner_.word()) != "polydata") {
      refuseMesh(path_, "it is a VTK file, but holds no polydata; save the surface as polydata, STL or PLY");
    }
    if (encoding == "binary") data_encoding_ = MeshScanner::Encoding::kBigEndian;
  }

  // Counts in the lines between the data are always text.
  std::uint64_t textCount() {
    scanner_.setEncoding(MeshScanner::Encoding::kAscii);
    return scanner_.count(NumberType::kUint32, kLargestIndex);
  }

  void beginData() {
    scanner_.line();
    scanner_.setEncoding(data_encoding_);
  }

  void readPoints() {
    const std::uint64_t count = textCount();
    const NumberType type = typeOf(scanner_.word(), path_);
    beginData();
    mesh_.points_mm.reserve(scanner_.countThatFits(count, 3));
    for (std::uint64_t i = 0; i < count; ++i) {
      Eigen::Vector3f point;
      for (int axis = 0; axis < 3; ++axis) point[axis] = static_cast<float>(scanner_.number(type));
      mesh_.points_mm.push_back(point);
    }
  }

  std::vector<std::uint64_t> readNumbers(std::uint64_t count, NumberType type, std::uint64_t largest) {
    beginData();
    std::vector<std::uint64_t> numbers(scanner_.countThatFits(count, 1));
    for (std::uint64_t& number : numbers) number = scanner_.count(type, largest);
    return numbers;
  }

  // A named array of version 5.1.
  std::vector<std::uint64_t> readArray(const std::string& name, std::uint64_t count) {
    if (lowerCase(scanner_.word()) != name) refuseMesh(path_, "its cells lack the array '" + name + "'");
    const NumberType type = typeOf(scanner_.word(), path_);
    return readNumbers(count, type, kLargestIndex);
  }

  void readCells(const std::string& kind) {
    const std::uint64_t first = textCount();
    const std::uint64_t second = textCount();
    if (isNewLayout()) {
      readOffsetCells(kind, first, second);
    } else {
      readCountedCells(kind, first, second);
    }
  }

  // Only the version tells in binary files; files of version 5 before 5.1 were not released.
  bool isNewLayout() {
    MeshScanner ahead = scanner_;
    ahead.line();
    return lowerCase(ahead.word()) == "offsets";
  }

  void readOffsetCells(const std::string& kind, std::uint64_t offsets_count, std::uint64_t corners_count) {
    const std::vector<std::uint64_t> offsets = readArray("offsets", offsets_count);
    const std::vector<std::uint64_t> corners = readArray("connectivity", corners_count);
    for (std::size_t cell = 0; cell + 1 < offsets.size(); ++cell) {
      if (offsets[cell] > offsets[cell + 1] || offsets[cell + 1] > corners.size()) refuseCells();
      addCell(kind, corners, offsets[cell], offsets[cell + 1]);
    }
  }

  void readCountedCells(const std::string& kind, std::uint64_t cells, std::uint64_t count) {
    const std::vector<std::uint64_t> numbers = readNumbers(count, NumberType::kInt32, kLargestIndex);
    std::size_t position = 0;
    for (std::uint64_t cell = 0; cell < cells; ++cell) {
      if (position >= numbers.size() || numbers[position] > numbers.size() - position - 1) refuseCells();
      addCell(kind, numbers, position + 1, position + 1 + numbers[position]);
      position += 1 + numbers[position];
    }
  }

  [[noreturn]] void refuseCells() const { refuseMesh(path_, "its cells contradict their sizes; it is damaged"); }

  void addCell(const std::string& kind, const std::vector<std::uint64_t>& corners, std::size_t begin, std::size_t end) {
    cell_.assign(corners.begin() + static_cast<std::ptrdiff_t>(begin),
                 corners.begin() + static_cast<std::ptrdiff_t>(end));
    if (kind == "polygons") addPolygon(cell_, &mesh_);
    if (kind != "triangle_strips") return;
    for (std::size_t i = 0; i + 2 < cell_.size(); ++i) {
      const std::size_t odd = i % 2;  // Every second triangle of a strip turns the other way.
      mesh_.triangles.push_back({cell_[i + odd], cell_[i + 1 - odd], cell_[i + 2]});
    }
  }

  MeshScanner scanner_;
  const std::string& path_;
  MeshScanner::Encoding data_encoding_ = MeshScanner::Encoding::kAscii;
  SurfaceMesh mesh_;
  std::vector<std::uint32_t> cell_;
};

}  // namespace

SurfaceMesh readVtk(const std::string& bytes, const std::string& path) { return VtkReader(bytes, path).read(); }

}  // namespace xray_registration
