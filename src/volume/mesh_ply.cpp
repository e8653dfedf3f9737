#include <algorithm>
#include <map>

#include "mesh_readers.h"
#include "mesh_scanner.h"

// PLY (Turk, 1994): a header that says what elements there are and what numbers each has, then the numbers.

namespace xray_registration {
namespace {

struct Property {
  std::string name;
  NumberType type = NumberType::kFloat;
  bool is_list = false;
  NumberType count_type = NumberType::kUint8;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

constexpr std::uint64_t kLargestIndex = 0xfffffffe;
constexpr std::uint64_t kLargestPolygon = 100000;

NumberType typeOf(const std::string& name, const std::string& path) {
  static const std::map<std::string, NumberType> types = {
      {"char", NumberType::kInt8},     {"int8", NumberType::kInt8},     {"uchar", NumberType::kUint8},
      {"uint8", NumberType::kUint8},   {"short", NumberType::kInt16},   {"int16", NumberType::kInt16},
      {"ushort", NumberType::kUint16}, {"uint16", NumberType::kUint16}, {"int", NumberType::kInt32},
      {"int32", NumberType::kInt32},   {"uint", NumberType::kUint32},   {"uint32", NumberType::kUint32},
      {"float", NumberType::kFloat},   {"float32", NumberType::kFloat}, {"double", NumberType::kDouble},
      {"float64", NumberType::kDouble}};
  const auto found = types.find(name);
  if (found == types.end()) refuseMesh(path, "its PLY header has the unknown type '" + name.substr(0, 20) + "'");
  return found->second;
}

MeshScanner::Encoding encodingOf(const std::string& name, const std::string& path) {
  if (name == "ascii") return MeshScanner::Encoding::kAscii;
  if (name == "binary_little_endian") return MeshScanner::Encoding::kLittleEndian;
  if (name == "binary_big_endian") return MeshScanner::Encoding::kBigEndian;
  refuseMesh(path, "its PLY header states the unknown format '" + name.substr(0, 20) + "'");
}

Property readProperty(MeshScanner* scanner, const std::string& path) {
  Property property;
  std::string type = scanner->word();
  property.is_list = type == "list";
  if (property.is_list) {
    property.count_type = typeOf(scanner->word(), path);
    type = scanner->word();
  }
  property.type = typeOf(type, path);
  property.name = scanner->word();
  return property;
}

// Leaves the scanner at the first number.
std::vector<Element> readHeader(MeshScanner* scanner, const std::string& path) {
  std::vector<Element> elements;
  auto encoding = MeshScanner::Encoding::kAscii;
  for (std::string word = scanner->word(); word != "end_header"; word = scanner->word()) {
    if (word.empty()) refuseMesh(path, "its PLY header has no end");
    if (word == "format") encoding = encodingOf(scanner->word(), path);
    if (word == "element") {
      elements.emplace_back();
      elements.back().name = scanner->word();
      elements.back().count = scanner->count(NumberType::kUint32, kLargestIndex);
    } else if (word == "property") {
      if (elements.empty()) refuseMesh(path, "its PLY header names a property before any element");
      elements.back().properties.push_back(readProperty(scanner, path));
    }
    scanner->line();
  }
  scanner->line();
  scanner->setEncoding(encoding);
  return elements;
}

// Reads one element of any kind; hands on each number, or the numbers of each list.
template <typename OnNumber, typename OnList>
void readElement(const Element& element, MeshScanner* scanner, const OnNumber& on_number, const OnList& on_list) {
  std::vector<double> list;
  for (const Property& property : element.properties) {
    if (property.is_list) {
      list.resize(scanner->count(property.count_type, kLargestPolygon));
      for (double& value : list) value = scanner->number(property.type);
      on_list(property, list);
    } else {
      on_number(property, scanner->number(property.type));
    }
  }
}

void readVertices(const Element& element, MeshScanner* scanner, SurfaceMesh* mesh) {
  mesh->points_mm.reserve(scanner->countThatFits(element.count, element.properties.size()));
  for (std::uint64_t i = 0; i < element.count; ++i) {
    Eigen::Vector3f point = Eigen::Vector3f::Zero();
    readElement(
        element, scanner,
        [&point](const Property& property, double value) {
          if (property.name.size() != 1) return;
          const char axis = property.name[0];
          if (axis >= 'x' && axis <= 'z') point[axis - 'x'] = static_cast<float>(value);
        },
        [](const Property&, const std::vector<double>&) {});
    mesh->points_mm.push_back(point);
  }
}

void readFaces(const Element& element, MeshScanner* scanner, const std::string& path, SurfaceMesh* mesh) {
  mesh->triangles.reserve(scanner->countThatFits(element.count, element.properties.size()));
  std::vector<std::uint32_t> corners;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    readElement(
        element, scanner, [](const Property&, double) {},
        [&](const Property& property, const std::vector<double>& list) {
          if (property.name != "vertex_indices" && property.name != "vertex_index") return;
          corners.clear();
          for (const double corner : list) {
            if (!(corner >= 0.0 && corner < 4294967295.0)) refuseMesh(path, "a face of it names an impossible point");
            corners.push_back(static_cast<std::uint32_t>(corner));
          }
          addPolygon(corners, mesh);
        });
  }
}

}  // namespace

SurfaceMesh readPly(const std::string& bytes, const std::string& path) {
  MeshScanner scanner(bytes, path);
  scanner.line();
  SurfaceMesh mesh;
  for (const Element& element : readHeader(&scanner, path)) {
    if (element.name == "vertex") {
      readVertices(element, &scanner, &mesh);
    } else if (element.name == "face") {
      readFaces(element, &scanner, path, &mesh);
    } else {
      for (std::uint64_t i = 0; i < element.count && !element.properties.empty(); ++i) {
        readElement(
            element, &scanner, [](const Property&, double) {}, [](const Property&, const std::vector<double>&) {});
      }
    }
  }
  return mesh;
}

}  // namespace xray_registration
