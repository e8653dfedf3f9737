#include "march_by_hand.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <thread>

#include "xray_registration/common/parallel.h"
#include "xray_registration/drr/opencl/opencl_volume.h"

#if defined(__x86_64__) && defined(__GNUC__)
#define XRAY_MARCH_BY_HAND 1
#include <immintrin.h>
#endif

namespace xray_registration::tools {
namespace {

constexpr int kRays = layout::kRays;
constexpr int kSumsOfRay = 5;

/// A linear form of the pixel.
float linear(const float* m, float u, float v) { return std::fma(m[0], u, std::fma(m[1], v, m[2])); }

/// One tile's rays in slices of the dominant axis, as PREPARE_RAYS of march.cl has them.
struct TileRays {
  alignas(64) std::array<float, kRays> p_c, m_p, q_c, m_q;
  float p_max = 0.0F;
  float q_max = 0.0F;
  int stride_p = 0;
  int stride_q = 0;
  int stride_k = 0;
  float centre_k = 0.0F;
  int first = 0;
  int last = -1;
};

TileRays raysOf(const DeviceGrid& grid, const PoseParameters& pose, const cl_int4& plan, int column, int row) {
  const int k = plan.s[0];
  const int a = (k + 1) % 3;
  const int b = (k + 2) % 3;
  const int p = k == 0 ? b : a;
  const int q = k == 0 ? a : b;
  const std::array<int, 3> strides = {1, grid.size[0], grid.size[0] * grid.size[1]};
  TileRays rays{};
  for (int ray = 0; ray < kRays; ++ray) {
    const auto i = static_cast<std::size_t>(ray);
    const int pixel_u = column + ray % layout::kTile;
    const int pixel_v = row + ray / layout::kTile;
    const float u = static_cast<float>(pixel_u) - pose[layout::kPoseMiddleU];
    const float v = static_cast<float>(pixel_v) - pose[layout::kPoseMiddleV];
    const auto direction = [&](int axis) { return linear(&pose[layout::kPoseDirection] + 3 * axis, u, v); };
    const auto cross = [&](int axis) { return linear(&pose[layout::kPoseCross] + 3 * axis, u, v); };
    const float inv_dk = 1.0F / direction(k);
    const float a_c = -cross(b) * inv_dk + grid.centre[a];
    const float b_c = cross(a) * inv_dk + grid.centre[b];
    rays.p_c[i] = k == 0 ? b_c : a_c;
    rays.q_c[i] = k == 0 ? a_c : b_c;
    rays.m_p[i] = direction(p) * inv_dk;
    rays.m_q[i] = direction(q) * inv_dk;
  }
  rays.p_max = static_cast<float>(grid.size[p] - 2);
  rays.q_max = static_cast<float>(grid.size[q] - 2);
  rays.stride_p = strides[static_cast<std::size_t>(p)];
  rays.stride_q = strides[static_cast<std::size_t>(q)];
  rays.stride_k = strides[static_cast<std::size_t>(k)];
  rays.centre_k = grid.centre[k];
  rays.first = plan.s[1];
  rays.last = plan.s[2];
  return rays;
}

#ifdef XRAY_MARCH_BY_HAND
// GCC 12 takes what its own headers leave undefined on purpose for a mistake.
#pragma GCC diagnostic push
#ifndef __clang__
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#pragma GCC diagnostic ignored "-Wuninitialized"

/// Sixteen rays from `first_ray` on. `kBytes`: 4 where a load is a word, 2 where it is two voxels of 16 bits.
template <int kBytes>
__attribute__((target("avx512f,avx512dq"))) void marchSixteen(const TileRays& rays, std::size_t first_ray,
                                                              const void* voxels, float* sums) {
  const __m512 p_c = _mm512_load_ps(&rays.p_c[first_ray]);
  const __m512 m_p = _mm512_load_ps(&rays.m_p[first_ray]);
  const __m512 q_c = _mm512_load_ps(&rays.q_c[first_ray]);
  const __m512 m_q = _mm512_load_ps(&rays.m_q[first_ray]);
  const __m512 zero = _mm512_setzero_ps();
  const __m512 p_max = _mm512_set1_ps(rays.p_max);
  const __m512 q_max = _mm512_set1_ps(rays.q_max);
  const __m512i stride_p = _mm512_set1_epi32(rays.stride_p);
  const __m512i stride_q = _mm512_set1_epi32(rays.stride_q);
  const __m512i low = _mm512_set1_epi32(0xffff);
  __m512 value = zero, sum_dp = zero, sum_dq = zero, sum_jdp = zero, sum_jdq = zero;
  for (int j = rays.first; j <= rays.last; ++j) {
    const __m512 t = _mm512_set1_ps(static_cast<float>(j) - rays.centre_k);
    const __m512 p = _mm512_min_ps(_mm512_max_ps(_mm512_fmadd_ps(t, m_p, p_c), zero), p_max);
    const __m512 q = _mm512_min_ps(_mm512_max_ps(_mm512_fmadd_ps(t, m_q, q_c), zero), q_max);
    const __m512i ip = _mm512_cvttps_epi32(p);
    const __m512i iq = _mm512_cvttps_epi32(q);
    const __m512 fp = _mm512_sub_ps(p, _mm512_cvtepi32_ps(ip));
    const __m512 fq = _mm512_sub_ps(q, _mm512_cvtepi32_ps(iq));
    const __m512i index = _mm512_add_epi32(_mm512_mullo_epi32(ip, stride_p), _mm512_mullo_epi32(iq, stride_q));
    const char* slice = static_cast<const char*>(voxels) + static_cast<std::ptrdiff_t>(j) * rays.stride_k * kBytes;
    const __m512i word0 = _mm512_i32gather_epi32(index, slice, kBytes);
    const __m512i word1 = _mm512_i32gather_epi32(_mm512_add_epi32(index, stride_q), slice, kBytes);
    const __m512 v00 = _mm512_cvtepi32_ps(_mm512_and_si512(word0, low));
    const __m512 v01 = _mm512_cvtepi32_ps(_mm512_srli_epi32(word0, 16));
    const __m512 v10 = _mm512_cvtepi32_ps(_mm512_and_si512(word1, low));
    const __m512 v11 = _mm512_cvtepi32_ps(_mm512_srli_epi32(word1, 16));
    const __m512 d0 = _mm512_sub_ps(v01, v00);
    const __m512 d1 = _mm512_sub_ps(v11, v10);
    const __m512 e0 = _mm512_fmadd_ps(fp, d0, v00);
    const __m512 dq = _mm512_sub_ps(_mm512_fmadd_ps(fp, d1, v10), e0);
    const __m512 dp = _mm512_fmadd_ps(fq, _mm512_sub_ps(d1, d0), d0);
    value = _mm512_add_ps(value, _mm512_fmadd_ps(fq, dq, e0));
    sum_dp = _mm512_add_ps(sum_dp, dp);
    sum_dq = _mm512_add_ps(sum_dq, dq);
    sum_jdp = _mm512_fmadd_ps(t, dp, sum_jdp);
    sum_jdq = _mm512_fmadd_ps(t, dq, sum_jdq);
  }
  _mm512_storeu_ps(sums + first_ray, value);
  _mm512_storeu_ps(sums + kRays + first_ray, sum_dp);
  _mm512_storeu_ps(sums + 2 * kRays + first_ray, sum_dq);
  _mm512_storeu_ps(sums + 3 * kRays + first_ray, sum_jdp);
  _mm512_storeu_ps(sums + 4 * kRays + first_ray, sum_jdq);
}

#pragma GCC diagnostic pop
#endif

/// Calls work(thread) on so many threads and returns the time from when all of them run to when all are done, ms.
template <typename Work>
double millisecondsOnThreads(int threads, const Work& work) {
  using Clock = std::chrono::steady_clock;
  std::atomic<int> waiting{threads};
  std::vector<Clock::time_point> begins(static_cast<std::size_t>(threads)), ends(begins.size());
  const auto run = [&](std::size_t thread) {
    --waiting;
    while (waiting.load() > 0) {
    }
    begins[thread] = Clock::now();
    work();
    ends[thread] = Clock::now();
  };
  {
    JoinedThreads others(begins.size());
    for (std::size_t thread = 1; thread < begins.size(); ++thread) {
      if (!others.start([&run, thread] { run(thread); })) throw std::runtime_error("no thread can be had");
    }
    run(0);
  }
  const auto time = *std::max_element(ends.begin(), ends.end()) - *std::min_element(begins.begin(), begins.end());
  return std::chrono::duration<double, std::milli>(time).count();
}

}  // namespace

bool MarchByHand::isPossible() {
#ifdef XRAY_MARCH_BY_HAND
  return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0;
#else
  return false;
#endif
}

MarchByHand::MarchByHand(const Engine& engine, const MarchProbe& probe, const XrayCamera& camera,
                         const RigidTransform& T_camera_ct)
    : plans_(probe.plans()), tiles_x_(layout::tilesFor(camera.width)) {
  const OpenClLevel& level = openClVolume(engine).levels().front();
  if (level.grid.has_voxels == 0) throw std::invalid_argument("the CT's voxels do not stand behind its words");
  grid_ = level.grid;
  pose_ = poseParameters(level, camera, T_camera_ct, T_camera_ct * engine.volume().centreCt());
  const auto bytes = level.words.getInfo<CL_MEM_SIZE>();
  words_.resize(bytes / sizeof(cl_uint) + 1);
  engine.device().openCl().solve_queue.enqueueReadBuffer(level.words, CL_TRUE, 0, bytes, words_.data());
  sums_.resize(plans_.size() * kSumsOfRay * kRays);
}

void MarchByHand::march(int tile) {
  const auto i = static_cast<std::size_t>(tile);
  const TileRays rays =
      raysOf(grid_, pose_, plans_[i], tile % tiles_x_ * layout::kTile, tile / tiles_x_ * layout::kTile);
  float* sums = sums_.data() + i * kSumsOfRay * kRays;
#ifdef XRAY_MARCH_BY_HAND
  const bool in_voxels = plans_[i].s[0] == 2;
  const void* voxels = words_.data() + static_cast<std::ptrdiff_t>(grid_.size[0]) * grid_.size[1] * grid_.size[2];
  for (std::size_t ray = 0; ray < kRays; ray += 16) {
    if (in_voxels) {
      marchSixteen<2>(rays, ray, voxels, sums);
    } else {
      marchSixteen<4>(rays, ray, words_.data(), sums);
    }
  }
#else
  (void)rays;
  (void)sums;
#endif
}

double MarchByHand::run() {
  if (!isPossible()) throw std::runtime_error("this processor has no AVX-512");
  std::atomic<int> next{0};
  return millisecondsOnThreads(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())), [&] {
    for (int tile = next++; tile < static_cast<int>(plans_.size()); tile = next++) march(tile);
  });
}

double MarchByHand::differenceFrom(const FloatImage& drr) const {
  double largest = 0.0;
  double difference = 0.0;
  for (int v = 0; v < drr.height; ++v) {
    for (int u = 0; u < drr.width; ++u) {
      const int tile = v / layout::kTile * tiles_x_ + u / layout::kTile;
      const int ray = v % layout::kTile * layout::kTile + u % layout::kTile;
      const float d_x = (static_cast<float>(u) - pose_[layout::kPoseMiddleU] - pose_[layout::kPoseCx]) *
                        pose_[layout::kPoseInverseFx];
      const float d_y = (static_cast<float>(v) - pose_[layout::kPoseMiddleV] - pose_[layout::kPoseCy]) *
                        pose_[layout::kPoseInverseFy];
      const int k = plans_[static_cast<std::size_t>(tile)].s[0];
      const float direction =
          linear(&pose_[layout::kPoseDirection] + 3 * k, static_cast<float>(u) - pose_[layout::kPoseMiddleU],
                 static_cast<float>(v) - pose_[layout::kPoseMiddleV]);
      const float mm = std::sqrt(d_x * d_x + d_y * d_y + 1.0F) / std::abs(direction) * pose_[layout::kPoseScale];
      const float value = sums_[static_cast<std::size_t>(tile * kSumsOfRay * kRays + ray)] * mm;
      largest = std::max<double>(largest, drr.at(u, v));
      difference = std::max<double>(difference, std::abs(value - drr.at(u, v)));
    }
  }
  return largest > 0.0 ? difference / largest : difference;
}

}  // namespace xray_registration::tools
