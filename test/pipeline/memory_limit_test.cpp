// A CT at every size of memory between too little and enough: refused or a fault, never the end of the process, and
// what comes afterwards is as if it had not been.
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <sstream>

#include "test/common/address_space.h"
#include "test/pipeline/fake_registrar.h"
#include "test/volume/test_files.h"
#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

constexpr int kSmallSide = 32;
constexpr double kSmallSpacingMm = 3.0;
// 32 MiB as it is stored: what the C library takes from the system anew each time, whatever was freed before.
constexpr int kLargeSide = 257;
constexpr std::size_t kLargeBytes = std::size_t{2} * kLargeSide * kLargeSide * kLargeSide;
constexpr std::size_t kEnough = 6 * kLargeBytes;
constexpr std::size_t kCoarseStep = kLargeBytes / 3;
constexpr std::size_t kFineStep = std::size_t{64} << 10U;  // Half of what the heap grows by.

/// A cube of water; the file is sparse.
std::string writeWater(const std::string& path, int side, double spacing_mm) {
  std::ostringstream header;
  header << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nElementSpacing = "
         << spacing_mm << " " << spacing_mm << " " << spacing_mm << "\nDimSize = " << side << " " << side << " " << side
         << "\nElementType = MET_SHORT\nElementDataFile = LOCAL\n";
  test_files::writeBytes(path, header.str());
  const auto voxels = static_cast<std::size_t>(side) * static_cast<std::size_t>(side) * static_cast<std::size_t>(side);
  std::filesystem::resize_file(path, header.str().size() + 2 * voxels);
  return path;
}

class MemoryLimit : public testing::Test {
 protected:
  void SetUp() override {
    if (!kAddressSpaceCanBeLimited) GTEST_SKIP() << "a sanitizer takes all the address space there is";
    pipeline_.loadCt(small_);
    const FrameOutcome outcome = frame();
    ASSERT_TRUE(outcome.registered) << outcome.result.reason;
    expected_ = outcome.result.T_camera_ct.matrix();
  }

  static NodeParameters parameters() {
    NodeParameters parameters;
    parameters.ct.read.check_values = false;  // Nothing but water.
    return parameters;
  }

  FrameOutcome frame() {
    RigidTransform T = RigidTransform::Identity();
    const double half_mm = 0.5 * kSmallSide * kSmallSpacingMm;
    T.translation() = Eigen::Vector3d(-half_mm, -half_mm, 600.0);
    pipeline_.setPose(T);
    return pipeline_.process(stamp_s_ += 0.1, {someView()});
  }

  /// What becomes of the large CT, in words.
  std::string loadWithin(std::size_t bytes) {
    const AddressSpaceLimit limit(bytes);
    std::string said = "loaded";
    try {
      pipeline_.loadCt(large_);
    } catch (const VolumeError& error) {
      said = std::string("refused: ") + error.what();
      EXPECT_NE(said.find(large_), std::string::npos) << said;
      EXPECT_EQ(pipeline_.fault(), "");
    } catch (const DeviceError& error) {
      said = std::string("fault: ") + error.what();
      EXPECT_EQ(pipeline_.fault(), error.what());
    }
    const FrameOutcome outcome = frame();
    EXPECT_TRUE(outcome.result.accepted || !outcome.result.reason.empty());
    EXPECT_FALSE(!pipeline_.fault().empty() && outcome.registered);
    return said;
  }

  /// The same, and that everything is right when there is memory again.
  const std::string& outcomeWith(std::size_t bytes) {
    SCOPED_TRACE("with " + std::to_string(bytes >> 10U) + " KiB");
    outcomes_[bytes] = loadWithin(bytes);
    pipeline_.loadCt(small_);
    const FrameOutcome after = frame();
    EXPECT_TRUE(after.registered) << after.result.reason;
    EXPECT_EQ(after.result.T_camera_ct.matrix(), expected_);
    return outcomes_[bytes];
  }

  /// Looks closer where one outcome becomes another: where memory ends within what is small.
  void refine(std::size_t low, std::size_t high) {
    if (high - low <= kFineStep || outcomes_[low] == outcomes_[high]) return;
    const std::size_t middle = low + (high - low) / 2;
    outcomeWith(middle);
    refine(low, middle);
    refine(middle, high);
  }

  const test_files::TemporaryFolder folder_;
  const std::string small_ = writeWater(folder_ / "small.mha", kSmallSide, kSmallSpacingMm);
  const std::string large_ = writeWater(folder_ / "large.mha", kLargeSide, 0.5);
  RegistrationPipeline pipeline_{parameters()};
  double stamp_s_ = 0.0;
  Eigen::Matrix4d expected_ = Eigen::Matrix4d::Zero();
  std::map<std::size_t, std::string> outcomes_;
};

TEST_F(MemoryLimit, ACtThatDoesNotFitIsRefusedOrAFault) {
  std::size_t last = 0;
  outcomeWith(last);
  for (std::size_t bytes = kCoarseStep; bytes <= kEnough; bytes += kCoarseStep) {
    outcomeWith(bytes);
    refine(last, bytes);
    last = bytes;
  }
  std::set<std::string> kinds;
  std::string before;
  for (const auto& [bytes, said] : outcomes_) {
    if (said != before) std::printf("from %zu KiB: %s\n", bytes >> 10U, said.c_str());
    before = said;
    kinds.insert(said.substr(0, said.find(':')));
  }
  std::printf("%zu sizes\n", outcomes_.size());
  EXPECT_EQ(kinds, (std::set<std::string>{"fault", "loaded", "refused"})) << "no limit met one of them";
}

}  // namespace
}  // namespace xray_registration
