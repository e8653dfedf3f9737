#pragma once

#include <string>
#include <vector>

namespace xray_registration {
namespace failing_opencl {

// A layer between a program and OpenCL that fails calls. It goes into an executable (failing_opencl.cpp among its
// sources), whose own functions the dynamic linker prefers to the library's. A program that a test starts is told by a
// file that both map, named in XRAY_FAILING_OPENCL; its contents are a Control.

/// All of it, in the file's order. 64-bit numbers, so that a test in another language can write it.
struct Control {
  long calls = 0;      ///< Counted since it was last set to 0.
  long first = -1;     ///< The first of the calls counted that fails; -1: none.
  long times = 1;      ///< How many of them fail.
  long failed = 0;     ///< How many have.
  char last[64] = {};  ///< The function that failed last.
};

/// Counting begins anew; call number `first` fails, and those after it until `times` have.
void failFrom(long first, long times = 1);

/// Every call from here on fails, until heal().
constexpr long kForGood = 1L << 60;

/// None fails; counting begins anew.
void heal();

/// Calls since then.
long calls();

/// How many failed since then.
long failures();

/// The function that failed last.
std::string lastFailed();

/// The functions of the calls since then, in order; not where a file is mapped.
std::vector<std::string> functions();

/// Numbers of calls that stand for all of them: of each function the first, the one in the middle and the last. All,
/// where XRAY_REGISTRATION_EVERY_CALL is set.
std::vector<long> callsToFail(const std::vector<std::string>& functions);

}  // namespace failing_opencl
}  // namespace xray_registration
