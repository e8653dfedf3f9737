#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "tools/benchmark/measure.h"

namespace xray_registration::tools {

void printRows(std::ostream& out, const std::vector<BenchmarkRow>& rows);

/// {"device": …, "rows": [{"name", "milliseconds_median", "milliseconds_p99", "runs", "samples_per_second"?, …}]}
/// @throws std::runtime_error when the file cannot be written.
void writeRowsJson(const std::string& path, const std::string& device, const std::vector<BenchmarkRow>& rows);

}  // namespace xray_registration::tools
