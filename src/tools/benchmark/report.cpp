#include "tools/benchmark/report.h"

#include <algorithm>
#include <cstdio>
#include <ostream>

namespace xray_registration::tools {
namespace {

using nlohmann::json;

json toJson(const BenchmarkRow& row) {
  json one = {{"name", row.name},
              {"milliseconds_median", row.milliseconds_median},
              {"milliseconds_p95", row.milliseconds_p95},
              {"milliseconds_p99", row.milliseconds_p99},
              {"runs", row.runs}};
  if (row.samples_per_second) one["samples_per_second"] = *row.samples_per_second;
  if (row.bytes) one["bytes"] = *row.bytes;
  if (!row.note.empty()) one["note"] = row.note;
  return one;
}

json toJson(const Goal& goal) {
  return {{"what", goal.what},   {"value", goal.value}, {"comparison", goal.at_least ? ">=" : "<="},
          {"limit", goal.limit}, {"unit", goal.unit},   {"met", goal.met()}};
}

json toJson(const PaperRun& run, bool per_iteration) {
  const double seconds = 1e-3 / (per_iteration ? std::max(run.iterations, 1) : 1);
  return {{"drr_s", run.drr_ms * seconds},
          {"other_s", run.other_ms * seconds},
          {"total_s", run.total_ms * seconds},
          {"iterations", run.iterations},
          {"converged", run.converged},
          {"relative_error", run.relative_error},
          {"angle_error_deg", run.angle_error_deg},
          {"shift_error_mm", run.shift_error_mm}};
}

/// What the paper left out stays out.
json toJson(const PublishedTimes& times) {
  json one = json::object();
  if (times.drr_s >= 0.0) one["drr_s"] = times.drr_s;
  if (times.other_s >= 0.0) one["other_s"] = times.other_s;
  if (times.total_s >= 0.0) one["total_s"] = times.total_s;
  if (times.iterations >= 0) one["iterations"] = times.iterations;
  return one;
}

json toJson(const PaperTable& table) {
  json rows = json::array();
  for (const PaperTableRow& row : table.rows) {
    rows.push_back({{"label", row.label},
                    {"cpp", toJson(row.cpp, table.per_iteration)},
                    {"opencl", toJson(row.opencl, table.per_iteration)},
                    {"published_cpp", toJson(row.published_cpp)},
                    {"published_gpu", toJson(row.published_gpu)}});
  }
  return {{"name", table.name}, {"per_iteration", table.per_iteration}, {"rows", rows}};
}

json toJson(const StepProfile& profile) {
  return {{"n", profile.n},
          {"axis", std::string(1, profile.axis)},
          {"step_ms", profile.step_ms},
          {"plan_ms", profile.plan_ms},
          {"march_ms", profile.march_ms},
          {"windows_ms", profile.windows_ms},
          {"rest_ms", profile.restMs()},
          {"drr_march_ms", profile.drr_march_ms},
          {"loads_only_ms", profile.loads_only_ms},
          {"samples", profile.samples},
          {"loaded_bytes", profile.loaded_bytes},
          {"volume_bytes", profile.volume_bytes},
          {"loads_share_of_march", profile.loads_only_ms / profile.march_ms},
          {"loads_share_of_drr_march", profile.loads_only_ms / profile.drr_march_ms},
          {"loaded_bytes_per_second", profile.loadedBytesPerSecond()},
          {"volume_bytes_per_second", profile.volume_bytes / (profile.march_ms * 1e-3)}};
}

}  // namespace

void printRows(std::ostream& out, const std::vector<BenchmarkRow>& rows) {
  char line[256];
  std::snprintf(line, sizeof line, "%-36s %12s %12s %12s %6s %12s  %s\n", "row", "median [ms]", "p95 [ms]", "p99 [ms]",
                "runs", "Msamples/s", "");
  out << line;
  for (const BenchmarkRow& row : rows) {
    char samples[32] = "";
    if (row.samples_per_second) std::snprintf(samples, sizeof samples, "%.0f", *row.samples_per_second * 1e-6);
    std::snprintf(line, sizeof line, "%-36s %12.3f %12.3f %12.3f %6zu %12s  %s\n", row.name.c_str(),
                  row.milliseconds_median, row.milliseconds_p95, row.milliseconds_p99, row.runs, samples,
                  row.note.c_str());
    out << line;
  }
  out << '\n';
}

void printCeiling(std::ostream& out, const Ceiling& ceiling) {
  if (ceiling.profiles.empty()) return;
  char line[256];
  std::snprintf(line, sizeof line, "%-10s %4s %10s %8s %8s %9s %10s %11s %12s %10s\n", "step", "axis", "whole [ms]",
                "plan", "march", "windows", "DRR march", "loads only", "of ceiling", "GB/s");
  out << line;
  for (const StepProfile& profile : ceiling.profiles) {
    std::snprintf(line, sizeof line, "%-10d %4c %10.3f %8.3f %8.3f %9.3f %10.3f %11.3f %10.0f %% %10.1f\n", profile.n,
                  profile.axis, profile.step_ms, profile.plan_ms, profile.march_ms, profile.windows_ms,
                  profile.drr_march_ms, profile.loads_only_ms, 100.0 * profile.loads_only_ms / profile.march_ms,
                  profile.loadedBytesPerSecond() * 1e-9);
    out << line;
  }
  std::snprintf(line, sizeof line, "copy, read and written: %.1f GB/s\n\n", ceiling.copy_bytes_per_second * 1e-9);
  out << line;
}

void printGoals(std::ostream& out, const std::vector<Goal>& goals) {
  char line[256];
  for (const Goal& goal : goals) {
    std::snprintf(line, sizeof line, "%-66s %10.3g %-3s goal %s %g: %s\n", goal.what.c_str(), goal.value,
                  goal.unit.c_str(), goal.at_least ? ">=" : "<=", goal.limit, goal.met() ? "met" : "MISSED");
    out << line;
  }
}

json toJson(const BenchmarkReport& report) {
  json written = {{"device", report.device}};
  written["rows"] = json::array();
  written["goals"] = json::array();
  written["paper_tables"] = json::array();
  for (const BenchmarkRow& row : report.rows) written["rows"].push_back(toJson(row));
  for (const Goal& goal : report.goals) written["goals"].push_back(toJson(goal));
  for (const PaperTable& table : report.tables) written["paper_tables"].push_back(toJson(table));
  if (!report.ceiling.profiles.empty()) {
    written["ceiling"] = {{"copy_bytes_per_second", report.ceiling.copy_bytes_per_second}, {"profiles", json::array()}};
    for (const StepProfile& one : report.ceiling.profiles) written["ceiling"]["profiles"].push_back(toJson(one));
  }
  return written;
}

}  // namespace xray_registration::tools
