#include "tools/benchmark/measure.h"

#include "tools/common/progress_bar.h"
#include "xray_registration/common/statistics.h"
#include "xray_registration/common/stopwatch.h"

namespace xray_registration::tools {

double millisecondsOf(const std::function<void()>& run) {
  const Stopwatch watch;
  run();
  return watch.milliseconds();
}

BenchmarkRow rowOf(const std::string& name, const std::vector<double>& milliseconds) {
  const Percentiles found = percentiles(milliseconds);
  BenchmarkRow row;
  row.name = name;
  row.runs = milliseconds.size();
  row.milliseconds_median = found.median;
  row.milliseconds_p95 = found.p95;
  row.milliseconds_p99 = found.p99;
  return row;
}

namespace {

// Long enough that a row of a millisecond is not judged by one run a turn.
constexpr double kTurnMs = 20.0;

/// The first run only brings this row's data back into the caches, where another row's are now.
void takeTurn(const std::function<void()>& run, std::vector<double>* times) {
  run();
  double spent_ms = 0.0;
  do {
    times->push_back(millisecondsOf(run));
    spent_ms += times->back();
  } while (spent_ms < kTurnMs);
}

}  // namespace

std::vector<BenchmarkRow> measureInTurns(const std::string& title, const std::vector<BenchmarkCase>& cases,
                                         int rounds) {
  ProgressBar bar(title, static_cast<std::size_t>(rounds) + 1);
  std::vector<std::vector<double>> times(cases.size());
  for (int round = 0; round < rounds; ++round) {
    bar.advanceTo(static_cast<std::size_t>(round) + 1);
    for (std::size_t i = 0; i < cases.size(); ++i) takeTurn(cases[i].run, &times[i]);
  }
  std::vector<BenchmarkRow> rows;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    rows.push_back(rowOf(cases[i].name, times[i]));
    if (cases[i].samples > 0.0) {
      rows.back().samples_per_second = cases[i].samples / (rows.back().milliseconds_median * 1e-3);
    }
    rows.back().note = cases[i].note;
  }
  return rows;
}

}  // namespace xray_registration::tools
