#include "xray_registration/ros/surface_marker.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

TEST(SurfaceMarker, IsInMetresInTheCtFrame) {
  TriangleMesh mesh;
  mesh.vertices_ct_mm = {{0, 0, 0}, {1000, 0, 0}, {0, 500, 0}};
  mesh.triangles = {{0, 1, 2}};
  const visualization_msgs::Marker marker = toMarker(mesh, "ct");
  EXPECT_EQ(marker.header.frame_id, "ct");
  EXPECT_EQ(marker.type, visualization_msgs::Marker::TRIANGLE_LIST);
  ASSERT_EQ(marker.points.size(), 3U);
  EXPECT_DOUBLE_EQ(marker.points[1].x, 1.0);
  EXPECT_DOUBLE_EQ(marker.points[2].y, 0.5);
  EXPECT_EQ(toMarker({}, "ct").action, visualization_msgs::Marker::DELETE);
}

}  // namespace
}  // namespace xray_registration
