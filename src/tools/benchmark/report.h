#pragma once

#include <iosfwd>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/benchmark/goals.h"
#include "tools/benchmark/measure.h"
#include "tools/benchmark/paper/paper_tables.h"
#include "tools/benchmark/profile.h"

namespace xray_registration::tools {

struct PaperTable {
  std::string name;            ///< "table1", "table2", "table2/<ct>".
  bool per_iteration = false;  ///< The report's seconds are per iteration, as in Table I.
  std::vector<PaperTableRow> rows;
};

/// Everything that one run of the tool found.
struct BenchmarkReport {
  std::string device;
  std::vector<BenchmarkRow> rows;
  std::vector<Goal> goals;
  std::vector<PaperTable> tables;
  Ceiling ceiling;
};

void printRows(std::ostream& out, const std::vector<BenchmarkRow>& rows);
void printCeiling(std::ostream& out, const Ceiling& ceiling);
void printGoals(std::ostream& out, const std::vector<Goal>& goals);

/// {"device": …, "rows": [{"name", "milliseconds_median", "milliseconds_p95", "milliseconds_p99", "runs",
/// "samples_per_second"?, "bytes"?, "note"?}], "goals": […], "paper_tables": […], "ceiling": {…}}
nlohmann::json toJson(const BenchmarkReport& report);

}  // namespace xray_registration::tools
