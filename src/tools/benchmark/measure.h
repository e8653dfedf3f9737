#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace xray_registration::tools {

/// One row of the result. Times are of single runs.
struct BenchmarkRow {
  std::string name;
  double milliseconds_median = 0.0;
  double milliseconds_p95 = 0.0;
  double milliseconds_p99 = 0.0;
  std::size_t runs = 0;
  std::optional<double> samples_per_second;  ///< March samples, at the median.
  std::optional<double> bytes;               ///< Rows about memory.
  std::string note;
};

/// Something to be timed. `samples` are the march samples of one run, 0 where that says nothing.
struct BenchmarkCase {
  std::string name;
  std::function<void()> run;
  double samples = 0.0;
  std::string note;
};

double millisecondsOf(const std::function<void()>& run);

/// Median, p95 and p99 of times of the same thing.
BenchmarkRow rowOf(const std::string& name, const std::vector<double>& milliseconds);

/// Runs all cases in turns, `rounds` times: a disturbance of the machine hits all of them alike. A turn is an untimed
/// run, then timed ones for 20 ms, one at least: in use a step follows a step, a frame a frame.
std::vector<BenchmarkRow> measureInTurns(const std::string& title, const std::vector<BenchmarkCase>& cases, int rounds);

}  // namespace xray_registration::tools
