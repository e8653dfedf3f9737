#pragma once

#include <cstdlib>  // Says whether it is glibc.

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace xray_registration {

/// Frames come many times a second, and each needs dozens of images that live for milliseconds. By default glibc gives
/// memory of that size back to the system at once, and gets it again page by page, cleared, which took a third of a
/// frame's preparation. From here on the process keeps up to 64 MiB of what is free for the next frame. For a process's
/// main function: it is a setting of the whole process, so a library (a nodelet) leaves it to its host.
inline void keepMemoryBetweenFrames() {
#ifdef __GLIBC__
  constexpr int kMiB = 1 << 20;
  mallopt(M_TRIM_THRESHOLD, 64 * kMiB);
  mallopt(M_MMAP_THRESHOLD, 32 * kMiB);  // The largest that glibc takes.
#endif
}

}  // namespace xray_registration
