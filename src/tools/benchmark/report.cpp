#include "tools/benchmark/report.h"

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>

namespace xray_registration::tools {

void printRows(std::ostream& out, const std::vector<BenchmarkRow>& rows) {
  char line[256];
  std::snprintf(line, sizeof line, "%-36s %12s %12s %6s %12s  %s\n", "row", "median [ms]", "p99 [ms]", "runs",
                "Msamples/s", "");
  out << line;
  for (const BenchmarkRow& row : rows) {
    char samples[32] = "";
    if (row.samples_per_second) std::snprintf(samples, sizeof samples, "%.0f", *row.samples_per_second * 1e-6);
    std::snprintf(line, sizeof line, "%-36s %12.3f %12.3f %6zu %12s  %s\n", row.name.c_str(), row.milliseconds_median,
                  row.milliseconds_p99, row.runs, samples, row.note.c_str());
    out << line;
  }
  out << '\n';
}

void writeRowsJson(const std::string& path, const std::string& device, const std::vector<BenchmarkRow>& rows) {
  nlohmann::json report;
  report["device"] = device;
  report["rows"] = nlohmann::json::array();
  for (const BenchmarkRow& row : rows) {
    nlohmann::json one = {{"name", row.name},
                          {"milliseconds_median", row.milliseconds_median},
                          {"milliseconds_p99", row.milliseconds_p99},
                          {"runs", row.runs}};
    if (row.samples_per_second) one["samples_per_second"] = *row.samples_per_second;
    if (row.bytes) one["bytes"] = *row.bytes;
    if (!row.note.empty()) one["note"] = row.note;
    report["rows"].push_back(std::move(one));
  }
  std::ofstream file(path);
  file << report.dump(1) << '\n';
  file.close();
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace xray_registration::tools
