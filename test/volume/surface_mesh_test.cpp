#include "xray_registration/volume/surface_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <string>

#include "test_files.h"
#include "test_meshes.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

using namespace test_files;

const SurfaceMesh kBox = test_meshes::box({-1.5, 2.0, 30.0}, {8.25, 12.0, 44.5});

template <typename T>
std::string little(T value) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return bytes;
}

template <typename T>
std::string big(T value) {
  std::string bytes = little(value);
  std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::string text(double value) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  stream << value;
  return stream.str();
}

std::string asciiStl(const SurfaceMesh& mesh) {
  std::string bytes = "solid an endsolid facet vertex name\n";
  for (const auto& triangle : mesh.triangles) {
    bytes += "  facet normal 0 0 1\n    outer loop\n";
    for (const std::uint32_t corner : triangle) {
      const Eigen::Vector3f& p = mesh.points_mm[corner];
      bytes += "      vertex " + text(p.x()) + " " + text(p.y()) + " " + text(p.z()) + "\r\n";
    }
    bytes += "    endloop\n  endfacet\n";
  }
  return bytes + "endsolid an endsolid name\n";
}

std::string binaryStl(const SurfaceMesh& mesh) {
  std::string bytes = "solid, says the header of many binary files";
  bytes.resize(80, ' ');
  bytes += little(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) {
    bytes += std::string(12, '\0');
    for (const std::uint32_t corner : triangle) {
      for (int i = 0; i < 3; ++i) bytes += little(mesh.points_mm[corner][i]);
    }
    bytes += std::string(2, '\7');
  }
  return bytes;
}

// With what other programs add: comments, colours, an element of another kind, quads.
std::string ply(const SurfaceMesh& mesh, const std::string& format) {
  std::string bytes = "ply\nformat " + format + " 1.0\ncomment made by a test\nelement camera 1\nproperty int id\n" +
                      "element vertex " + std::to_string(mesh.points_mm.size()) +
                      "\nproperty float x\nproperty float y\nproperty double z\nproperty uchar red\nelement face " +
                      std::to_string(mesh.triangles.size()) +
                      "\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n";
  const auto put = [&](auto value) {
    if (format == "ascii") {
      bytes += text(static_cast<double>(value)) + " ";
    } else {
      bytes += format == "binary_big_endian" ? big(value) : little(value);
    }
  };
  put(std::int32_t{10});
  for (const Eigen::Vector3f& p : mesh.points_mm) {
    put(p.x());
    put(p.y());
    put(static_cast<double>(p.z()));
    put(std::uint8_t{200});
  }
  for (const auto& triangle : mesh.triangles) {
    put(std::uint8_t{32});
    put(std::uint8_t{3});
    for (const std::uint32_t corner : triangle) put(static_cast<std::int32_t>(corner));
  }
  return bytes;
}

std::string vtk(const SurfaceMesh& mesh, bool binary, bool offsets) {
  std::string bytes = std::string("# vtk DataFile Version ") + (offsets ? "5.1" : "3.0") + "\na title\n" +
                      (binary ? "BINARY" : "ASCII") + "\nDATASET POLYDATA\nPOINTS " +
                      std::to_string(mesh.points_mm.size()) + " float\n";
  const auto put = [&](auto value) { bytes += binary ? big(value) : text(static_cast<double>(value)) + " "; };
  for (const Eigen::Vector3f& p : mesh.points_mm) {
    for (int i = 0; i < 3; ++i) put(p[i]);
  }
  bytes += "\nMETADATA\nINFORMATION 1\nNAME something POINTS\n\n";
  const std::size_t n = mesh.triangles.size();
  if (!offsets) {
    bytes += "POLYGONS " + std::to_string(n) + " " + std::to_string(4 * n) + "\n";
    for (const auto& triangle : mesh.triangles) {
      put(std::int32_t{3});
      for (const std::uint32_t corner : triangle) put(static_cast<std::int32_t>(corner));
    }
  } else {
    bytes += "POLYGONS " + std::to_string(n + 1) + " " + std::to_string(3 * n) + "\nOFFSETS vtktypeint64\n";
    for (std::size_t i = 0; i <= n; ++i) put(static_cast<std::int64_t>(3 * i));
    bytes += "\nCONNECTIVITY vtktypeint64\n";
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t corner : triangle) put(static_cast<std::int64_t>(corner));
    }
  }
  return bytes + "\nPOINT_DATA 8\nSCALARS a float\nLOOKUP_TABLE default\n";
}

// Corner by corner, whatever the points' order.
std::vector<Eigen::Vector3f> cornersOf(const SurfaceMesh& mesh) {
  std::vector<Eigen::Vector3f> corners;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) corners.push_back(mesh.points_mm.at(corner));
  }
  return corners;
}

std::string messageOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const VolumeError& error) {
    return error.what();
  }
  return "no VolumeError";
}

class SurfaceMeshFile : public testing::Test {
 protected:
  SurfaceMesh readBytes(const std::string& bytes) {
    writeBytes(folder_ / "mesh.dat", bytes);  // The name says nothing.
    return readMesh(folder_ / "mesh.dat");
  }

  std::string refusalOf(const std::string& bytes) {
    return messageOf([&] { readBytes(bytes); });
  }

  TemporaryFolder folder_;
};

TEST_F(SurfaceMeshFile, EveryFormatGivesTheSameTriangles) {
  const std::vector<Eigen::Vector3f> expected = cornersOf(kBox);
  const std::string files[] = {asciiStl(kBox),
                               binaryStl(kBox),
                               ply(kBox, "ascii"),
                               ply(kBox, "binary_little_endian"),
                               ply(kBox, "binary_big_endian"),
                               vtk(kBox, false, false),
                               vtk(kBox, true, false),
                               vtk(kBox, false, true),
                               vtk(kBox, true, true)};
  for (const std::string& file : files) {
    const SurfaceMesh mesh = readBytes(file);
    EXPECT_EQ(cornersOf(mesh), expected) << file.substr(0, 60);
    EXPECT_EQ(mesh.points_mm.size(), 8U) << file.substr(0, 60);
  }
}

TEST_F(SurfaceMeshFile, PolygonsAndStripsBecomeTriangles) {
  const std::string points =
      "# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 1 1 0\n";
  const SurfaceMesh polygon = readBytes(points + "POLYGONS 1 5\n4 0 1 3 2\n");
  EXPECT_EQ(polygon.triangles, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 3}, {0, 3, 2}}));
  const SurfaceMesh strip = readBytes(points + "LINES 1 3\n2 0 1\nTRIANGLE_STRIPS 1 5\n4 0 1 2 3\n");
  EXPECT_EQ(strip.triangles, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {2, 1, 3}}));
}

TEST_F(SurfaceMeshFile, TruncatedFilesAreRefusedByName) {
  for (const std::string& whole :
       {asciiStl(kBox), binaryStl(kBox), ply(kBox, "ascii"), ply(kBox, "binary_big_endian")}) {
    for (const double share : {0.1, 0.5, 0.95}) {
      const std::string part = whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size())));
      EXPECT_NE(refusalOf(part).find("mesh.dat'"), std::string::npos) << whole.substr(0, 30) << share;
    }
  }
  for (const bool offsets : {false, true}) {
    std::string whole = vtk(kBox, true, offsets);
    whole.resize(whole.find("POINT_DATA") - 10);
    EXPECT_NE(refusalOf(whole).find("truncated"), std::string::npos);
  }
}

TEST_F(SurfaceMeshFile, ImpossibleHeadersAreRefusedBeforeMemoryIsTaken) {
  EXPECT_NE(
      refusalOf("ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n0").find("truncated"),
      std::string::npos);
  EXPECT_NE(refusalOf("# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS 4000000000 float\n0 0 0")
                .find("truncated"),
            std::string::npos);
  EXPECT_NE(refusalOf("# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS -4 float\n0 0 0").find("damaged"),
            std::string::npos);
}

TEST_F(SurfaceMeshFile, RefusalsSayWhatToDo) {
  EXPECT_NE(refusalOf("nothing of the kind").find("no STL, PLY or VTK"), std::string::npos);
  EXPECT_NE(refusalOf("<?xml version=\"1.0\"?><VTKFile/>").find(".vtp"), std::string::npos);
  EXPECT_NE(refusalOf("solid empty\nendsolid empty\n").find("no triangles"), std::string::npos);
  EXPECT_NE(refusalOf("# vtk DataFile Version 3.0\n\nASCII\nDATASET STRUCTURED_POINTS\n").find("polydata"),
            std::string::npos);
  SurfaceMesh broken = kBox;
  broken.points_mm[3].x() = std::numeric_limits<float>::infinity();
  EXPECT_NE(refusalOf(binaryStl(broken)).find("no finite number"), std::string::npos);
  EXPECT_NE(refusalOf("solid a\nfacet\nvertex 0 0 zero\n").find("'zero'"), std::string::npos);
  SurfaceMesh wrong_index = kBox;
  wrong_index.triangles[3][1] = 8;
  EXPECT_NE(refusalOf(vtk(wrong_index, false, false)).find("not there"), std::string::npos);
  EXPECT_NE(messageOf([&] { readMesh(folder_ / "missing.stl"); }).find("missing.stl"), std::string::npos);
  EXPECT_NE(messageOf([&] { readMesh(folder_.path().string()); }).find("folder"), std::string::npos);
}

TEST_F(SurfaceMeshFile, OutsideTheDirectoryNothingIsRead) {
  writeBytes(folder_ / "mesh.stl", binaryStl(kBox));
  const std::string inside = folder_ / "inside";
  fs::create_directory(inside);
  EXPECT_NE(messageOf([&] { readMesh(folder_ / "mesh.stl", inside); }).find("outside"), std::string::npos);
  EXPECT_EQ(readMesh(folder_ / "mesh.stl", folder_.path().string()).triangles.size(), 12U);
}

}  // namespace
}  // namespace xray_registration
