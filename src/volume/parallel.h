#pragma once

#include <algorithm>
#include <system_error>
#include <thread>
#include <vector>

namespace xray_registration {

/// Calls work(begin, end) on parts of [0, count), one part per host thread, and waits. The parts are disjoint, so the
/// result of a function that only writes to its own part does not depend on the number of threads. A part that gets no
/// thread (memory for its stack, most likely) is worked on by the caller. `work` must not throw.
template <typename Work>
void parallelFor(int count, const Work& work) {
  const int threads = std::min(count, static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  if (threads <= 1) {
    if (count > 0) work(0, count);
    return;
  }
  const auto bound = [=](int part) { return static_cast<int>(static_cast<long long>(count) * part / threads); };
  std::vector<std::thread> others;
  others.reserve(static_cast<std::size_t>(threads - 1));
  for (int part = 1; part < threads; ++part) {
    try {
      others.emplace_back([&work, bound, part] { work(bound(part), bound(part + 1)); });
    } catch (const std::system_error&) {
      work(bound(part), bound(part + 1));
    }
  }
  work(0, bound(1));
  for (std::thread& thread : others) thread.join();
}

}  // namespace xray_registration
