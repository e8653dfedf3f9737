#include "tools/register_bag/motion_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "tools/common/command_line.h"

namespace xray_registration::tools {
namespace {

std::vector<std::string> cellsOf(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',') {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

// A row's cells by their columns' names.
std::map<std::string, std::string> rowOf(const MotionTable& table, const TableFrame& frame) {
  const auto names = cellsOf(table.header());
  const auto cells = cellsOf(table.row(frame));
  EXPECT_EQ(names.size(), cells.size());
  std::map<std::string, std::string> row;
  for (std::size_t i = 0; i < std::min(names.size(), cells.size()); ++i) {
    EXPECT_TRUE(row.emplace(names[i], cells[i]).second) << names[i] << " is there twice";
  }
  return row;
}

double number(const std::map<std::string, std::string>& row, const std::string& name) {
  return std::stod(row.at(name));
}

RigidTransform poseOf(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_mm) {
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = rotationFromVector(turn_rad);
  pose.translation() = shift_mm;
  return pose;
}

const Eigen::Vector3d kCentre(20.0, -70.0, -250.0);

// T11 is turned by 2° about the CT's x through its centre and shifted by (1, 2, 3) mm.
TableFrame frameOfTwo() {
  TableFrame frame;
  frame.stamp_s = 1700000000.25;
  frame.accepted = true;
  frame.T_camera_ct = poseOf({0.1, -0.2, 0.3}, {5.0, -6.0, 900.0});
  RigidTransform motion = poseOf({2.0 * M_PI / 180.0, 0.0, 0.0}, Eigen::Vector3d::Zero());
  motion.translation() = kCentre + Eigen::Vector3d(1.0, 2.0, 3.0) - motion.linear() * kCentre;
  frame.bodies = {{"T12", frame.T_camera_ct, true, true}, {"T11", frame.T_camera_ct * motion, true, true}};
  return frame;
}

TableSetup setupOfTwo() { return {true, {{"T12", Eigen::Vector3d::Zero()}, {"T11", kCentre}}, {}}; }

TEST(MotionTable, HoldsPosesInTheCamera) {
  const auto row = rowOf(MotionTable(setupOfTwo()), frameOfTwo());
  EXPECT_EQ(row.at("stamp_s"), "1700000000.250000");
  EXPECT_EQ(row.at("ct_accepted"), "1");
  EXPECT_NEAR(number(row, "ct_x_mm"), 5.0, 1e-4);
  EXPECT_NEAR(number(row, "ct_z_mm"), 900.0, 1e-4);
  EXPECT_NEAR(number(row, "ct_ry_deg"), -0.2 * 180.0 / M_PI, 1e-4);
  const Eigen::Quaterniond q(number(row, "T12_qw"), number(row, "T12_qx"), number(row, "T12_qy"),
                             number(row, "T12_qz"));
  EXPECT_LT((q.toRotationMatrix() - frameOfTwo().T_camera_ct.linear()).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(MotionTable, HoldsMotionAgainstTheRestAndAmongBodies) {
  const auto row = rowOf(MotionTable(setupOfTwo()), frameOfTwo());
  EXPECT_NEAR(number(row, "T12_in_ct_rx_deg"), 0.0, 1e-4);
  for (const std::string other : {"ct", "T12"}) {
    const std::string name = "T11_in_" + other;
    EXPECT_NEAR(number(row, name + "_rx_deg"), 2.0, 1e-4);
    EXPECT_NEAR(number(row, name + "_cardan_x_deg"), 2.0, 1e-4);
    EXPECT_NEAR(number(row, name + "_cardan_y_deg"), 0.0, 1e-4);
    // The centre moved by what it was shifted, whatever the turn did to the frame's far origin.
    EXPECT_NEAR(number(row, name + "_shift_x_mm"), 1.0, 1e-4);
    EXPECT_NEAR(number(row, name + "_shift_y_mm"), 2.0, 1e-4);
    EXPECT_NEAR(number(row, name + "_shift_z_mm"), 3.0, 1e-4);
  }
  EXPECT_EQ(row.count("T12_in_T11_x_mm"), 0U);  // Each pair once.
}

TEST(MotionTable, CellsOfWhatWasRefusedAreEmpty) {
  const MotionTable table(setupOfTwo());
  TableFrame frame = frameOfTwo();
  frame.bodies[1].accepted = false;
  auto row = rowOf(table, frame);
  EXPECT_EQ(row.at("T11_accepted"), "0");
  for (const char* name : {"T11_x_mm", "T11_qw", "T11_in_ct_shift_x_mm", "T11_in_T12_cardan_x_deg"}) {
    EXPECT_EQ(row.at(name), "") << name;
  }
  EXPECT_NE(row.at("T12_in_ct_x_mm"), "");
  frame.bodies[1].solved = false;
  EXPECT_EQ(rowOf(table, frame).at("T11_accepted"), "");
  frame.bodies.pop_back();
  EXPECT_EQ(rowOf(table, frame).at("T11_accepted"), "");
  // Without the rest, bodies still have their poses, and one another.
  frame = frameOfTwo();
  frame.accepted = false;
  row = rowOf(table, frame);
  EXPECT_EQ(row.at("ct_accepted"), "0");
  EXPECT_EQ(row.at("ct_x_mm"), "");
  EXPECT_EQ(row.at("T11_in_ct_x_mm"), "");
  EXPECT_NE(row.at("T11_x_mm"), "");
  EXPECT_NE(row.at("T11_in_T12_x_mm"), "");
}

TEST(MotionTable, WithoutACtThereAreNoColumnsOfIt) {
  TableSetup setup = setupOfTwo();
  setup.has_ct = false;
  const MotionTable table(setup);
  EXPECT_EQ(table.header().rfind("stamp_s,T12_accepted,T12_x_mm", 0), 0U);
  EXPECT_EQ(table.header().find("ct_"), std::string::npos);
  EXPECT_EQ(rowOf(table, frameOfTwo()).count("T11_in_T12_x_mm"), 1U);
}

TEST(MotionTable, HoldsAKnee) {
  TableSetup setup{true, {{"femur", Eigen::Vector3d::Zero()}, {"tibia", Eigen::Vector3d::Zero()}}, {}};
  setup.knee = parseKnee("femur,tibia,left", setup.bodies);
  EXPECT_EQ(setup.knee->side, Side::kLeft);
  TableFrame frame = frameOfTwo();
  frame.bodies = {{"femur", frame.T_camera_ct, true, true},
                  {"tibia", frame.T_camera_ct * poseOf({-0.5, 0.0, 0.0}, {-4.0, 0.0, 0.0}), true, true}};
  auto row = rowOf(MotionTable(setup), frame);
  EXPECT_NEAR(number(row, "knee_flexion_deg"), 0.5 * 180.0 / M_PI, 1e-4);
  EXPECT_NEAR(number(row, "knee_adduction_deg"), 0.0, 1e-4);
  EXPECT_NEAR(number(row, "knee_lateral_mm"), 4.0, 1e-4);
  // In a CT's axes the same turn is extension.
  setup.knee->T_femur_anatomy = anatomyInCt();
  setup.knee->T_tibia_anatomy = anatomyInCt();
  EXPECT_NEAR(number(rowOf(MotionTable(setup), frame), "knee_flexion_deg"), -0.5 * 180.0 / M_PI, 1e-4);
  frame.bodies[0].accepted = false;
  row = rowOf(MotionTable(setup), frame);
  EXPECT_EQ(row.at("knee_flexion_deg"), "");
}

TEST(MotionTable, TheKneeIsNamedInWords) {
  const std::vector<TableBodySetup> bodies = {{"femur", Eigen::Vector3d::Zero()}, {"tibia", Eigen::Vector3d::Zero()}};
  EXPECT_EQ(parseKnee("femur,tibia", bodies).side, Side::kRight);
  for (const char* wrong : {"femur", "femur,tibia,up", "femur,patella", "femur,femur", "femur,tibia,left,x", ""}) {
    EXPECT_THROW(parseKnee(wrong, bodies), ArgumentError) << wrong;
  }
}

TEST(MotionTable, IsWrittenLineByLine) {
  const std::string path = (std::filesystem::temp_directory_path() / "xray_motion_table_test.csv").string();
  const MotionTable table(setupOfTwo());
  table.write(path, {frameOfTwo(), frameOfTwo()});
  std::ifstream file(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  std::filesystem::remove(path);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0], table.header());
  EXPECT_EQ(lines[2], table.row(frameOfTwo()));
  EXPECT_THROW(table.write("/nowhere/a.csv", {}), std::runtime_error);
}

}  // namespace
}  // namespace xray_registration::tools
