// A device whose calls fail, one after the other, once and for good: while a CT is loaded, at a cold start, while
// tracking with and without a look at the set-up, and while a picture is drawn. No frame is ever given a wrong pose.
#include <gtest/gtest.h>

#include <cmath>

#include "test/drr/opencl/failing_opencl.h"
#include "test/pipeline/fake_registrar.h"
#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

namespace fo = failing_opencl;

constexpr double kWrongMm = 1.0;  ///< In-plane; of these coarse voxels right poses are within 0.3 mm.

class FailingDevice : public testing::Test {
 protected:
  FailingDevice() {
    attenuation_ = toAttenuation(ct_, AttenuationModel{});
    centre_ct_ = anatomicalCentreCt(attenuation_);
    for (int number = 0; number < 3; ++number) frames_.push_back(drawn(number));
  }
  void TearDown() override { fo::heal(); }

  static NodeParameters parameters() {
    NodeParameters parameters;
    parameters.registrar.check_every = 1;
    parameters.registrar.max_image_pixels = 20000;
    return parameters;
  }

  RigidTransform pose(int number) const {
    Eigen::Matrix3d R;
    R << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    RigidTransform T = RigidTransform::Identity();
    T.linear() = R;
    T.translation() = Eigen::Vector3d(1.0 * number, -0.8 * number, 750.0) - R * centre_ct_;
    return T;
  }

  RawView drawn(int number) const {
    const XrayCamera camera{96, 96, 300.0, 300.0, 47.5, 47.5};
    const FloatImage lines = referenceProjection(attenuation_, pose(number), camera, 1);
    RawView view;
    view.image = RawImage{FloatImage(camera.width, camera.height), 65535.0};
    for (std::size_t i = 0; i < lines.pixels.size(); ++i) {
      view.image->pixels.floats.pixels[i] = std::round(40000.0F * std::exp(-lines.pixels[i]));
    }
    view.calibration.width = camera.width;
    view.calibration.height = camera.height;
    view.calibration.k = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
    return view;
  }

  FrameOutcome frame(int number) {
    return pipeline_.process(stamp_s_ += 0.1, {frames_[static_cast<std::size_t>(number)]});
  }

  double inPlaneError(int number, const FrameOutcome& outcome) const {
    return (outcome.result.T_camera_ct * centre_ct_ - pose(number) * centre_ct_).head<2>().norm();
  }

  void expectAccepted(int number) {
    const FrameOutcome outcome = frame(number);
    ASSERT_TRUE(outcome.result.accepted) << outcome.result.reason;
    EXPECT_LT(inPlaneError(number, outcome), kWrongMm);
  }

  /// A healthy device that tracks, whatever was before.
  void track() {
    fo::heal();
    pipeline_.reset();
    pipeline_.setPose(pose(0));
    ASSERT_NO_FATAL_FAILURE(expectAccepted(0));
  }

  /// What a frame may be while a call fails.
  void expectRightOrRefused(int number, const FrameOutcome& outcome) {
    if (outcome.result.accepted) {
      EXPECT_LT(inPlaneError(number, outcome), kWrongMm);
    } else {
      EXPECT_NE(outcome.result.reason.find("code -5"), std::string::npos) << outcome.result.reason;
    }
  }

  /// After it failed once: no fault, and the next frame is found without a new start.
  void expectOpenedAnew() {
    EXPECT_EQ(pipeline_.fault(), "");
    expectAccepted(2);
  }

  /// While it goes on failing, nothing is given; afterwards a reset is enough.
  void expectFaultUntilReset() {
    EXPECT_EQ(pipeline_.state(), TrackingState::kFault);
    EXPECT_NE(pipeline_.fault().find("code -5"), std::string::npos) << pipeline_.fault();
    EXPECT_FALSE(frame(2).result.accepted);
    fo::heal();
    const FrameOutcome still = frame(2);
    EXPECT_FALSE(still.result.accepted);
    EXPECT_EQ(still.result.reason, pipeline_.fault());
    track();
  }

  /// Fails every chosen call of `work`, which begins with `prepare`, and shows what comes of it to `look`.
  template <typename Prepare, typename Work>
  void sweep(const Prepare& prepare, const Work& work) {
    for (int i = 0; i < 2; ++i) {  // What is only done the first time does not count.
      ASSERT_NO_FATAL_FAILURE(prepare());
      fo::heal();
      work();
    }
    const std::vector<std::string> functions = fo::functions();
    ASSERT_FALSE(functions.empty());
    int faults = 0;
    int untouched = 0;
    for (const long call : fo::callsToFail(functions)) {
      for (const long times : {1L, fo::kForGood}) {
        SCOPED_TRACE("call " + std::to_string(call) + " of " + std::to_string(functions.size()) + ", " +
                     functions[static_cast<std::size_t>(call)] + (times == 1 ? ", once" : ", for good"));
        ASSERT_NO_FATAL_FAILURE(prepare());
        fo::failFrom(call, times);
        work();
        untouched += fo::failures() == 0 ? 1 : 0;
        if (times == 1) {
          fo::heal();
          ASSERT_NO_FATAL_FAILURE(expectOpenedAnew());
        } else if (!pipeline_.fault().empty()) {
          ++faults;
          ASSERT_NO_FATAL_FAILURE(expectFaultUntilReset());
        }
      }
    }
    EXPECT_GT(faults, 0);
    // A device that was opened anew may do with a few calls less.
    EXPECT_LT(untouched, 10);
  }

  const Volume ct_ = headPhantom(5.0);
  AttenuationVolume attenuation_;
  Eigen::Vector3d centre_ct_ = Eigen::Vector3d::Zero();
  std::vector<RawView> frames_;
  RegistrationPipeline pipeline_{parameters()};
  double stamp_s_ = 0.0;
};

TEST_F(FailingDevice, WhileACtIsLoaded) {
  const auto load = [this] {
    try {
      pipeline_.setCt(ct_);
    } catch (const DeviceError& error) {
      EXPECT_EQ(pipeline_.fault(), error.what());
      EXPECT_NE(pipeline_.fault().find("code -5"), std::string::npos) << pipeline_.fault();
    }
    pipeline_.setPose(pose(0));
  };
  pipeline_.openDevice();
  // A load that failed once was tried once more, so there is a CT now.
  sweep([] { fo::heal(); }, load);
}

TEST_F(FailingDevice, AtAColdStart) {
  pipeline_.setCt(ct_);
  sweep(
      [this] {
        track();
        pipeline_.setPose(pose(0));
      },
      [this] { expectRightOrRefused(1, frame(1)); });
}

TEST_F(FailingDevice, WhileTracking) {
  pipeline_.setCt(ct_);
  sweep([this] { track(); }, [this] { expectRightOrRefused(1, frame(1)); });
}

TEST_F(FailingDevice, WhileAPictureIsDrawn) {
  pipeline_.setCt(ct_);
  const XrayCamera camera{96, 96, 300.0, 300.0, 47.5, 47.5};
  sweep([this] { track(); }, [&] { pipeline_.renderDrr(camera, pose(0)); });
}

TEST_F(FailingDevice, AtTheStart) {
  fo::heal();
  pipeline_.openDevice();
  const std::vector<std::string> functions = fo::functions();
  for (const long call : fo::callsToFail(functions)) {
    SCOPED_TRACE("call " + std::to_string(call) + ", " + functions[static_cast<std::size_t>(call)]);
    RegistrationPipeline pipeline(parameters());
    fo::failFrom(call, fo::kForGood);
    try {
      pipeline.openDevice();
    } catch (const DeviceError& error) {
      EXPECT_NE(std::string(error.what()).find("code -5"), std::string::npos) << error.what();
      EXPECT_EQ(pipeline.fault(), error.what());
      EXPECT_EQ(pipeline.state(), TrackingState::kFault);
    }
    fo::heal();
    pipeline.setCt(ct_);  // Opens it.
    EXPECT_EQ(pipeline.fault(), "");
    EXPECT_EQ(pipeline.state(), TrackingState::kWaitingForPose);
  }
}

}  // namespace
}  // namespace xray_registration
