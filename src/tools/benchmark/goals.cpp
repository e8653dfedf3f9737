#include "tools/benchmark/goals.h"

namespace xray_registration::tools {
namespace {

class Rows {
 public:
  explicit Rows(const std::vector<BenchmarkRow>& rows) : rows_(rows) {}

  const BenchmarkRow* find(const std::string& name) const {
    for (const BenchmarkRow& row : rows_) {
      if (row.name == name) return &row;
    }
    return nullptr;
  }

  void median(const std::string& name, const std::string& what, double limit_ms) {
    if (const BenchmarkRow* row = find(name)) goals.push_back({what, row->milliseconds_median, false, limit_ms, "ms"});
  }

  void p99(const std::string& name, const std::string& what, double limit_ms) {
    if (const BenchmarkRow* row = find(name)) goals.push_back({what, row->milliseconds_p99, false, limit_ms, "ms"});
  }

  std::vector<Goal> goals;

 private:
  const std::vector<BenchmarkRow>& rows_;
};

void addRatios(Rows* rows) {
  const BenchmarkRow* cpp = rows->find("step/paper/cpp/128");
  const BenchmarkRow* opencl = rows->find("step/paper/opencl/128");
  const BenchmarkRow* fast = rows->find("step/fast/128");
  const BenchmarkRow* large = rows->find("step/fast/256");
  if (cpp == nullptr || opencl == nullptr || fast == nullptr || large == nullptr) return;
  rows->goals.push_back({"one step at 128, against the paper's method in plain C++",
                         cpp->milliseconds_median / fast->milliseconds_median, true, 200.0, "x"});
  rows->goals.push_back({"one step at 128, against the paper's method on the same device",
                         opencl->milliseconds_median / fast->milliseconds_median, true, 50.0, "x"});
  rows->goals.push_back({"samples per second of a step, 256 against 128",
                         *large->samples_per_second / *fast->samples_per_second, true, 0.7, "x"});
}

}  // namespace

std::vector<Goal> goalsOf(const std::vector<BenchmarkRow>& all, bool gpu) {
  Rows rows(all);
  addRatios(&rows);
  for (const char* start : {"2", "4", "6"}) {
    rows.median(std::string("registration/table2/") + start,
                std::string("whole registration, Table II's start at ") + start, 30.0);
  }
  if (const BenchmarkRow* memory = rows.find("memory/512")) {
    if (memory->bytes) {
      rows.goals.push_back({"device memory of a 512^3 CT against its 16-bit size",
                            *memory->bytes / (2.0 * 512.0 * 512.0 * 512.0), false, 2.5, "x"});
    }
  }
  rows.median("tracked_frame/head_lateral", "tracked frame, head_lateral, median", 12.0);
  rows.p99("tracked_frame/head_lateral", "tracked frame, head_lateral, p99", 66.0);
  rows.median("tracked_frame/pelvis_biplane", "tracked frame, pelvis_biplane, both views, median", 66.0);
  rows.median("tracked_frame/head_1024_biplane_ap", "tracked frame of 1024^2, one view, median", 33.0);
  rows.p99("tracked_frame/head_1024_biplane_ap", "tracked frame of 1024^2, one view, p99", 66.0);
  rows.median("tracked_frame/head_1024_biplane", "tracked frame of 1024^2, two views, median", 66.0);
  rows.median("tracked_frame/wrist_biplane", "tracked frame of the wrist, two views of 1760^2, median", 200.0);
  rows.median("cold_start/head_lateral", "cold start, head, median", 60.0);
  rows.median("cold_start/spine_biplane", "cold start, chest, two views, median", 250.0);
  rows.median("cold_start/wrist_biplane", "cold start, wrist, two views of 1760^2, median", 600.0);
  if (gpu) {
    rows.median("step/fast/128", "one step at 128 on a GPU", 0.05);
    rows.median("frame/fast/256", "tracked frame of 256^3 and 256^2 on a GPU", 1.0);
    rows.median("frame/fast/512", "tracked frame of 512^3 and 512^2 on a GPU", 5.0);
    rows.median("drr/fast/200/kernel", "kernels of a 200^2 DRR from 256^3 on a GPU", 0.04);
  }
  return rows.goals;
}

}  // namespace xray_registration::tools
