// Loaded before a program (LD_PRELOAD), this shifts the program's wall clock by what a file says, as NTP does when it
// sets one; the steady clock goes on. The file, which SHIFTED_CLOCK_FILE names, holds nanoseconds in eight bytes, and
// may be written at any time.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <ctime>

namespace {

constexpr std::int64_t kNanoseconds = 1000000000;

const volatile std::int64_t* mapped() {
  const char* name = std::getenv("SHIFTED_CLOCK_FILE");
  const int file = name == nullptr ? -1 : open(name, O_RDONLY | O_CLOEXEC);
  if (file < 0) return nullptr;
  void* memory = mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, file, 0);
  close(file);
  return memory == MAP_FAILED ? nullptr : static_cast<const volatile std::int64_t*>(memory);
}

std::int64_t shiftNs() {
  static const volatile std::int64_t* const shift = mapped();
  return shift == nullptr ? 0 : *shift;
}

timespec shifted(const timespec& time, std::int64_t by_ns) {
  const std::int64_t sum = time.tv_sec * kNanoseconds + time.tv_nsec + by_ns;
  return {sum / kNanoseconds, sum % kNanoseconds};
}

template <typename Function>
Function* next(const char* name, const char* version) {
  void* found = dlvsym(RTLD_NEXT, name, version);
  return reinterpret_cast<Function*>(found != nullptr ? found : dlsym(RTLD_NEXT, name));
}

/// Seconds since 1970, not since the machine was started.
bool isOfTheWallClock(const timespec& time) { return time.tv_sec > kNanoseconds; }

}  // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  static auto* const real = next<int(clockid_t, timespec*)>("clock_gettime", "GLIBC_2.17");
  const int result = real(clock, time);
  if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) *time = shifted(*time, shiftNs());
  return result;
}

int gettimeofday(timeval* time, void* /*zone*/) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  *time = {now.tv_sec, now.tv_nsec / 1000};
  return 0;
}

time_t time(time_t* seconds) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (seconds != nullptr) *seconds = now.tv_sec;
  return now.tv_sec;
}

// Deadlines by the wall clock are the shifted one's.
int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* deadline) {
  static auto* const real =
      next<int(pthread_cond_t*, pthread_mutex_t*, const timespec*)>("pthread_cond_timedwait", "GLIBC_2.3.2");
  const timespec true_deadline = isOfTheWallClock(*deadline) ? shifted(*deadline, -shiftNs()) : *deadline;
  return real(condition, mutex, &true_deadline);
}

int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const timespec* deadline) {
  static auto* const real =
      next<int(pthread_cond_t*, pthread_mutex_t*, clockid_t, const timespec*)>("pthread_cond_clockwait", "GLIBC_2.30");
  const timespec true_deadline = clock == CLOCK_REALTIME ? shifted(*deadline, -shiftNs()) : *deadline;
  return real(condition, mutex, clock, &true_deadline);
}

}  // extern "C"
