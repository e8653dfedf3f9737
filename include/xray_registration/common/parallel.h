#pragma once

#include <algorithm>
#include <exception>
#include <new>
#include <system_error>
#include <thread>
#include <vector>

namespace xray_registration {

/// Threads that are waited for, whatever happens.
class JoinedThreads {
 public:
  explicit JoinedThreads(std::size_t most) { threads_.reserve(most); }
  ~JoinedThreads() { join(); }
  JoinedThreads(const JoinedThreads&) = delete;
  JoinedThreads& operator=(const JoinedThreads&) = delete;

  /// False when no thread can be had: memory for its stack, most likely.
  template <typename Work>
  bool start(Work work) {
    try {
      threads_.emplace_back(std::move(work));
      return true;
    } catch (const std::system_error&) {
      return false;
    } catch (const std::bad_alloc&) {
      return false;
    }
  }

  void join() {
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }

 private:
  std::vector<std::thread> threads_;
};

/// Calls work(begin, end) on parts of [0, count), one part per host thread, and waits. The parts are disjoint, so the
/// result of a function that only writes to its own part does not depend on the number of threads. A part that gets no
/// thread is worked on by the caller.
/// @throws what `work` throws, of the first part that does; the other parts are done.
template <typename Work>
void parallelFor(int count, const Work& work) {
  const int threads = std::min(count, static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  if (threads <= 1) {
    if (count > 0) work(0, count);
    return;
  }
  std::vector<std::exception_ptr> failures(static_cast<std::size_t>(threads));
  const auto run = [&work, &failures, count, threads](int part) noexcept {
    const auto bound = [=](int i) { return static_cast<int>(static_cast<long long>(count) * i / threads); };
    try {
      work(bound(part), bound(part + 1));
    } catch (...) {
      failures[static_cast<std::size_t>(part)] = std::current_exception();
    }
  };
  JoinedThreads others(static_cast<std::size_t>(threads - 1));
  for (int part = 1; part < threads; ++part) {
    if (!others.start([&run, part] { run(part); })) run(part);
  }
  run(0);
  others.join();
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
}

}  // namespace xray_registration
