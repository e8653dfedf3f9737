#pragma once

#include <vector>

#include "tools/benchmark/march_probe.h"
#include "xray_registration/drr/engine.h"
#include "xray_registration/drr/opencl/pose_parameters.h"

namespace xray_registration::tools {

/// The march by hand, in AVX-512 instructions: the same plan, positions, loads and five sums as the kernels'
/// (march.cl), without the chain rule and the tiles' sums behind them. What a compiler's vector code can be measured
/// by. Sixteen rays keep their sums in registers through all slices.
class MarchByHand {
 public:
  /// Whether this processor has the instructions, and the compiler knew them.
  static bool isPossible();

  /// What `probe` has planned, of the engine's finest level; copies the CT. @throws std::invalid_argument for a CT
  /// whose voxels do not stand behind its words.
  MarchByHand(const Engine& engine, const MarchProbe& probe, const XrayCamera& camera,
              const RigidTransform& T_camera_ct);

  /// All tiles on all of the host's threads; ms, without the threads' start.
  double run();

  /// Largest difference of the line integrals from a DRR, as a share of its largest value; after a run.
  double differenceFrom(const FloatImage& drr) const;

 private:
  void march(int tile);

  DeviceGrid grid_{};
  PoseParameters pose_{};
  std::vector<cl_uint> words_;  ///< And the voxels behind them.
  std::vector<cl_int4> plans_;
  int tiles_x_ = 0;
  std::vector<float> sums_;  ///< Per tile: 5 × 64.
};

}  // namespace xray_registration::tools
