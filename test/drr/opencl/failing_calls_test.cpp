// Every call that the engine makes of OpenCL fails, one after the other: an error in words, and an engine that works as
// before when the device does.
#include <gtest/gtest.h>

#include <cmath>

#include "test/drr/opencl/failing_opencl.h"
#include "xray_registration/drr/engine.h"

namespace xray_registration {
namespace {

namespace fo = failing_opencl;

AttenuationVolume lopsidedBlob() {
  AttenuationVolume volume;
  volume.grid.size = Eigen::Vector3i(26, 22, 24);
  volume.grid.spacing_mm = Eigen::Vector3d(1.0, 1.1, 1.2);
  volume.scale_per_mm = 1e-6F;
  volume.face_is_cut.fill(true);
  for (int z = 0; z < 24; ++z) {
    for (int y = 0; y < 22; ++y) {
      for (int x = 0; x < 26; ++x) {
        const double value =
            40000.0 * std::exp(-(Eigen::Vector3d(x, y, z) - Eigen::Vector3d(14, 10, 12)).squaredNorm() / 30.0);
        volume.values.push_back(value < 50.0 ? 0 : static_cast<std::uint16_t>(value));
      }
    }
  }
  return volume;
}

void add(const std::vector<float>& numbers, std::vector<double>* all) {
  all->insert(all->end(), numbers.begin(), numbers.end());
}

void add(const std::vector<StepSums>& steps, std::vector<double>* all) {
  for (const StepSums& step : steps) {
    all->insert(all->end(), step.matrix.data(), step.matrix.data() + step.matrix.size());
    all->insert(all->end(), step.gradient.data(), step.gradient.data() + step.gradient.size());
    all->insert(all->end(), {step.cost, step.weight, step.similarity});
  }
}

/// Everything that an engine does, and the numbers that come out.
std::vector<double> work(Engine* engine) {
  const XrayCamera camera{72, 64, 400.0, 400.0, 35.5, 31.5};  // Of two levels.
  engine->setVolume(lopsidedBlob());
  RigidTransform pose = RigidTransform::Identity();
  pose.translation() = Eigen::Vector3d(0, 0, 200.0) - engine->volume().centreCt();
  RigidTransform beside = pose;
  beside.translation().x() += 1.5;
  std::vector<double> numbers;
  const FloatImage drawn = engine->render(camera, 0, pose);
  add(drawn.pixels, &numbers);
  const auto xray = engine->upload(camera, drawn, FloatImage(camera.width, camera.height, 1.0F));
  numbers.push_back(engine->weighUnexplained(xray.get(), pose, 1.0));
  const WindowOptions windows = windowsFor(Similarity::kLocalNormalised, xray->deviation());
  for (int level = 1; level >= 0; --level) {
    add(engine->evaluate(xray.get(), level, 0, {beside}, windows), &numbers);
    add(engine->evaluate(xray.get(), level, 0, {pose, beside, pose}, windows), &numbers);
    add(engine->windowCorrelations(), &numbers);
  }
  engine->keepContrastTiles(xray.get(), 0, 0.5);
  add(engine->addUpTiles(xray.get(), 0, 0, camera, beside, {RayMotion()}).sums, &numbers);
  engine->restoreWeights(xray.get());
  const auto look = engine->share(xray.get());
  look->leaveOut({{0.0, 0.0, 8.0, 8.0}});
  engine->surround(look.get(), 0, 0, pose);
  const auto other = engine->share(xray.get());
  engine->surroundAs(other.get(), 0, look.get());
  add(engine->addUpBody(other.get(), 0, 0, beside).sums, &numbers);
  for (const FloatImage& image : engine->renderWithDerivatives(camera, 0, beside)) add(image.pixels, &numbers);
  return numbers;
}

/// Does it; with an error, what it says.
template <typename Work>
std::string errorOf(const Work& work) {
  try {
    work();
    return "";
  } catch (const DeviceError& error) {
    return error.what();
  }
}

/// What is done last of all, and what nobody waits for: by then the work is done.
bool mayGoUnnoticed(const std::string& function) {
  return function.rfind("clRelease", 0) == 0 || function == "clFinish";
}

class FailingCalls : public testing::Test {
 protected:
  void TearDown() override { fo::heal(); }
};

TEST_F(FailingCalls, AnEngineIsAsBeforeWhenTheDeviceIs) {
  const std::unique_ptr<Engine> first = makeEngineOpenCl(std::make_shared<Device>());
  const std::vector<double> expected = work(first.get());
  long call = 0;
  // What is called changes a little from time to time, as buffers and events are used again: until none is left.
  for (bool is_left = true; is_left; ++call) {
    for (const long times : {1L, fo::kForGood}) {
      // With buffers of its own that are still to be made, and kernels that are there.
      const std::unique_ptr<Engine> engine = first->sibling();
      fo::failFrom(call, times);
      std::vector<double> found;
      const std::string error = errorOf([&] { found = work(engine.get()); });
      is_left = fo::failures() > 0;
      const std::string failed = fo::lastFailed();
      fo::heal();
      SCOPED_TRACE("call " + std::to_string(call) + ", " + failed + (times == 1 ? ", once" : ", for good"));
      if (error.empty()) {
        EXPECT_TRUE(!is_left || mayGoUnnoticed(failed));
        ASSERT_EQ(found, expected);
      } else {
        EXPECT_NE(error.find(engine->device().name()), std::string::npos) << error;
      }
      ASSERT_EQ(work(engine.get()), expected);
    }
  }
  EXPECT_GT(call, 300);
}

TEST_F(FailingCalls, ADeviceThatDoesNotOpenIsSaid) {
  const auto open = [] { makeEngineOpenCl(std::make_shared<Device>()); };
  fo::heal();
  open();
  const std::vector<std::string> functions = fo::functions();
  ASSERT_GT(functions.size(), 30U);
  for (const long call : fo::callsToFail(functions)) {
    for (const long times : {1L, fo::kForGood}) {
      fo::failFrom(call, times);
      const std::string said = errorOf(open);
      ASSERT_GT(fo::failures(), 0);
      const std::string failed = fo::lastFailed();
      fo::heal();
      SCOPED_TRACE("call " + std::to_string(call) + ", " + failed);
      EXPECT_TRUE(mayGoUnnoticed(failed) || said.find("code -5") != std::string::npos) << said;
    }
  }
  open();
}

}  // namespace
}  // namespace xray_registration
