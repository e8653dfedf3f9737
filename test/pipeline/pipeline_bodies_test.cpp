// What the pipeline makes of bodies, with a registrar that does what the test tells it.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "test/pipeline/fake_registrar.h"
#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/volume/volume_error.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration {
namespace {

/// Soft tissue with two blocks of bone, `first` and `second` of the labels 1 and 2.
class Bodies : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("xray_bodies_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::create_directories(folder_);
    ct_.grid.size = {16, 16, 16};
    ct_.grid.spacing_mm = {4.0, 4.0, 4.0};
    ct_.hu.assign(ct_.grid.voxelCount(), 40);
    Volume labels = ct_;
    labels.hu.assign(ct_.grid.voxelCount(), 0);
    paint(3, 1, &labels);
    paint(10, 2, &labels);
    writeVolume(labels, labelsPath());
    parameters_.ct.mask = labelsPath();
    parameters_.ct.surface_threshold_hu = 250.0;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void paint(int from, std::int16_t label, Volume* labels) {
    for (int z = from; z < from + 3; ++z) {
      for (int y = 6; y < 9; ++y) {
        for (int x = 6; x < 9; ++x) {
          const std::size_t voxel = (static_cast<std::size_t>(z) * 16 + y) * 16 + x;
          ct_.hu[voxel] = 900;
          labels->hu[voxel] = label;
        }
      }
    }
  }
  std::string labelsPath() const { return (folder_ / "labels.nii.gz").string(); }

  static BodyParameters cut(const std::string& name, int label) {
    BodyParameters body;
    body.name = body.frame = name;
    body.labels = {label};
    return body;
  }
  /// A tetrahedron, 20 mm high.
  BodyParameters mesh(const std::string& name) const {
    const std::string path = (folder_ / "mesh.ply").string();
    std::ofstream(path) << "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                           "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
                           "0 0 0\n20 0 0\n0 20 0\n0 0 20\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
    BodyParameters body;
    body.name = body.frame = name;
    body.mesh = path;
    return body;
  }

  RegistrationPipeline make() { return {parameters_, fakes(&script_), {}}; }
  static bool same(const RigidTransform& a, const RigidTransform& b) { return a.isApprox(b, 1e-9); }
  /// View of someView's size.
  static ViewInput view() {
    XrayFrame frame;
    frame.camera = {32, 24, 1000.0, 1000.0, 15.5, 11.5};
    return {frame};
  }

  std::filesystem::path folder_;
  Volume ct_;
  NodeParameters parameters_;
  Script script_;
};

TEST_F(Bodies, ABodyIsGivenAStartOfItsOwnAndTheOthersGoOn) {
  parameters_.bodies = {cut("first", 1), cut("second", 2)};
  RegistrationPipeline pipeline = make();
  pipeline.setCt(ct_);
  EXPECT_FALSE(pipeline.setBodyPose("first", somePose(5.0), 0.9));  // Where the CT is, is not known.
  pipeline.setPose(somePose());
  pipeline.process(1.0, {someView()});
  pipeline.process(1.1, {someView()});
  ASSERT_TRUE(script_.last_body_starts.at(0).tracking);

  EXPECT_TRUE(pipeline.setBodyPose("first", somePose(5.0), 1.2));
  EXPECT_FALSE(pipeline.setBodyPose("third", somePose(5.0), 1.2));
  const FrameOutcome outcome = pipeline.process(1.2, {someView()});
  EXPECT_TRUE(same(outcome.result.bodies.at(0).T_camera_body, somePose(5.0)));
  EXPECT_FALSE(script_.last_body_starts.at(0).tracking);
  EXPECT_TRUE(script_.last_body_starts.at(1).tracking);
  EXPECT_TRUE(script_.last_tracking);  // The CT.
}

TEST_F(Bodies, ABodyStartsWhereTheCtHasItOrWhereItIsConfiguredTo) {
  parameters_.bodies = {cut("first", 1), cut("second", 2)};
  parameters_.bodies[1].initial_pose = somePose(7.0);
  RegistrationPipeline pipeline = make();
  pipeline.setCt(ct_);
  pipeline.setPose(somePose(2.0));
  const FrameOutcome outcome = pipeline.process(1.0, {someView()});
  ASSERT_EQ(outcome.result.bodies.size(), 2U);
  EXPECT_TRUE(same(outcome.result.bodies[0].T_camera_body, somePose(2.0)));
  EXPECT_TRUE(same(outcome.result.bodies[1].T_camera_body, somePose(7.0)));
}

TEST_F(Bodies, ABodyOfItsOwnNeedsNoCtAndGoesBackToItsConfiguredStart) {
  parameters_.ct.mask.clear();
  parameters_.bodies = {mesh("screw")};
  parameters_.bodies[0].initial_pose = somePose(3.0);
  RegistrationPipeline pipeline = make();
  EXPECT_NE(pipeline.process(0.5, {someView()}).result.reason.find("no bodies"), std::string::npos);
  pipeline.loadBodies();
  ASSERT_TRUE(pipeline.hasStart(1.0));
  const FrameOutcome outcome = pipeline.process(1.0, {someView()});
  ASSERT_EQ(outcome.result.bodies.size(), 1U);
  EXPECT_TRUE(outcome.result.accepted);
  EXPECT_TRUE(outcome.result.bodies[0].accepted);
  pipeline.setBodyPose("screw", somePose(5.0), 1.1);
  EXPECT_TRUE(same(pipeline.process(1.1, {someView()}).result.T_camera_ct, somePose(5.0)));
  pipeline.reset();
  EXPECT_TRUE(same(pipeline.process(1.2, {someView()}).result.T_camera_ct, somePose(3.0)));
}

TEST_F(Bodies, AMeshThatCannotBeReadIsNamed) {
  parameters_.ct.mask.clear();
  parameters_.bodies = {mesh("screw")};
  std::filesystem::remove(parameters_.bodies[0].mesh);
  RegistrationPipeline pipeline = make();
  try {
    pipeline.loadBodies();
    FAIL() << "read what is not there";
  } catch (const VolumeError& error) {
    EXPECT_NE(std::string(error.what()).find("mesh.ply"), std::string::npos) << error.what();
  }
}

TEST_F(Bodies, OneIsRegisteredThatHasAStartWhenTheFirstHasNone) {
  parameters_.ct.mask.clear();
  parameters_.bodies = {mesh("screw"), mesh("plate")};
  parameters_.bodies[1].initial_pose = somePose(3.0);
  RegistrationPipeline pipeline = make();
  pipeline.loadBodies();
  const FrameOutcome outcome = pipeline.process(1.0, {someView()});
  ASSERT_EQ(outcome.result.bodies.size(), 2U);
  EXPECT_FALSE(outcome.result.accepted);
  EXPECT_FALSE(outcome.result.bodies[0].accepted);
  EXPECT_TRUE(outcome.result.bodies[1].accepted) << outcome.result.bodies[1].reason;
}

TEST_F(Bodies, PicturesAreMadeOfTheRestAndEachBody) {
  parameters_.bodies = {cut("first", 1), cut("second", 2), mesh("screw")};
  script_.accepts_bodies = {true, false};
  RegistrationPipeline pipeline = make();
  pipeline.setCt(ct_);
  pipeline.setPose(somePose());
  const RegistrationResult result = pipeline.process(1.0, {someView()}).result;
  ASSERT_EQ(result.bodies.size(), 3U);
  const DrrParts parts = pipeline.renderParts(view(), result);
  ASSERT_EQ(parts.bodies.size(), 3U);
  EXPECT_EQ(parts.ct.pixels.front(), 1.0F);
  EXPECT_EQ(parts.bodies[0].pixels.front(), 10.0F);
  EXPECT_EQ(parts.bodies[1].pixels.front(), 20.0F);
  EXPECT_EQ(parts.bodies[2].pixels.front(), 0.0F);
  EXPECT_EQ(acceptedDrr(parts, result).pixels.front(), 11.0F);
}

TEST_F(Bodies, ARefusedCtIsShownWhole) {
  parameters_.bodies = {cut("first", 1)};
  script_.accepts = false;
  RegistrationPipeline pipeline = make();
  pipeline.setCt(ct_);
  pipeline.setPose(somePose());
  const RegistrationResult result = pipeline.process(1.0, {someView()}).result;
  const DrrParts parts = pipeline.renderParts(view(), result);
  EXPECT_EQ(parts.ct.pixels.front(), 0.0F);
  ASSERT_EQ(parts.bodies.size(), 1U);
  EXPECT_TRUE(parts.bodies[0].empty());
}

TEST_F(Bodies, ShapesAreTheRestAndEachBody) {
  parameters_.bodies = {cut("first", 1), mesh("screw")};
  RegistrationPipeline pipeline = make();
  pipeline.setCt(ct_);
  const std::vector<BodyShape> shapes = pipeline.shapes();
  ASSERT_EQ(shapes.size(), 3U);
  EXPECT_EQ(shapes[0].name, "");
  EXPECT_DOUBLE_EQ(shapes[0].surface_per_mm, 0.025);
  EXPECT_EQ(shapes[1].name, "first");
  EXPECT_NEAR(shapes[1].surface_per_mm, 0.025 - 0.0208, 1e-9);  // Above the soft tissue that it displaces.
  EXPECT_EQ(shapes[2].name, "screw");
  EXPECT_DOUBLE_EQ(shapes[2].surface_per_mm, 0.125);
}

TEST_F(Bodies, TheOnlyBodysCovarianceIsAboutTheCtsCentre) {
  parameters_.ct.label = 1;
  // About a point 10 mm in x from the CT's centre; only the turn about z is not known.
  script_.on_body = [](BodyResult* body) {
    body->centre_ct_mm = Eigen::Vector3d(11.0, 2.0, 3.0);  // The fake's centre is (1, 2, 3).
    body->covariance(5, 5) = 1e-4;
  };
  RegistrationPipeline pipeline = make();
  pipeline.setCt(ct_);
  pipeline.setPose(somePose());
  const RegistrationResult result = pipeline.process(1.0, {someView()}).result;
  ASSERT_TRUE(result.accepted) << result.reason;
  EXPECT_TRUE(result.bodies.empty());
  EXPECT_NEAR(result.covariance(1, 1), 100.0 * 1e-4, 1e-12);  // 10 mm away, y moves.
  EXPECT_NEAR(result.covariance(0, 0), 0.0, 1e-12);
  EXPECT_NEAR(result.covariance(5, 5), 1e-4, 1e-12);
}

}  // namespace
}  // namespace xray_registration
