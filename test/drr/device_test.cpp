#include "xray_registration/drr/device.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "xray_registration/drr/opencl/opencl_device.h"

namespace xray_registration {
namespace {

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

bool isListed(const std::string& name) {
  const std::vector<std::string> names = listDevices();
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool hasDeviceOfType(bool gpu) {
  for (const std::string& name : listDevices()) {
    if (Device(name).isGpu() == gpu) return true;
  }
  return false;
}

std::string messageOf(const std::string& choice) {
  try {
    const Device device(choice);
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

TEST(DeviceTest, AutoIsAListedDevice) {
  const Device device("auto");
  EXPECT_FALSE(device.name().empty());
  EXPECT_TRUE(isListed(device.name())) << device.name();
  EXPECT_GT(device.maxAllocationBytes(), 0U);
  EXPECT_GE(device.globalMemoryBytes(), device.maxAllocationBytes());
  EXPECT_GE(device.computeUnits(), 1);
}

TEST(DeviceTest, AutoPrefersAGpu) { EXPECT_EQ(Device("auto").isGpu(), hasDeviceOfType(true)); }

TEST(DeviceTest, AnEmptyChoiceIsAuto) { EXPECT_EQ(Device("").name(), Device("auto").name()); }

TEST(DeviceTest, TypesChooseTheirType) {
  for (const bool gpu : {false, true}) {
    const std::string choice = gpu ? "gpu" : "cpu";
    if (hasDeviceOfType(gpu)) {
      EXPECT_EQ(Device(choice).isGpu(), gpu);
      EXPECT_EQ(Device(upper(choice)).name(), Device(choice).name());
    } else {
      const std::string message = messageOf(choice);
      EXPECT_NE(message.find("'" + choice + "'"), std::string::npos) << message;
    }
  }
}

TEST(DeviceTest, APartOfTheNameChooses) {
  for (const std::string& name : listDevices()) {
    const std::string part = name.substr(name.size() / 3, name.size() / 2);
    // Several devices may share the part; the case does not matter.
    EXPECT_NE(Device(part).name().find(part), std::string::npos);
    EXPECT_EQ(Device(upper(part)).name(), Device(part).name());
  }
}

TEST(DeviceTest, AnUnknownNameIsAnErrorThatListsTheDevices) {
  const std::string message = messageOf("no such device");
  EXPECT_NE(message.find("'no such device'"), std::string::npos) << message;
  for (const std::string& name : listDevices()) {
    EXPECT_NE(message.find("'" + name + "'"), std::string::npos) << message;
  }
}

TEST(DeviceTest, TheDeviceIsLogged) {
  std::string logged;
  const Device device("auto", [&](LogLevel level, const std::string& text) {
    if (level == LogLevel::kInfo) logged += text;
  });
  EXPECT_NE(logged.find(device.name()), std::string::npos) << logged;
}

TEST(DeviceTest, ProgramsAreBuiltWithTheirOptions) {
  const Device device;
  const cl::Program program =
      device.openCl().build("__kernel void wanted(__global int* x) { x[0] = VALUE; }", "-cl-std=CL1.2 -DVALUE=5");
  EXPECT_NO_THROW(cl::Kernel(program, "wanted"));
}

TEST(DeviceTest, AFailedBuildShowsTheCompilersLog) {
  const Device device;
  try {
    device.openCl().build("__kernel void broken(__global int* x) { x[0] = an_unheard_of_name; }", "-cl-std=CL1.2");
    FAIL() << "a broken program was built";
  } catch (const DeviceError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find(device.name()), std::string::npos) << message;
    EXPECT_NE(message.find("an_unheard_of_name"), std::string::npos) << message;
    EXPECT_EQ(error.code(), CL_BUILD_PROGRAM_FAILURE);
  }
}

TEST(DeviceTest, ManyComeAndGo) {
  // Each owns its context; none is left behind or shared.
  for (int i = 0; i < 5; ++i) {
    Device first;
    Device second;
    EXPECT_NE(first.openCl().context(), second.openCl().context());
    EXPECT_NE(first.openCl().solve_queue(), first.openCl().upload_queue());
  }
}

}  // namespace
}  // namespace xray_registration
