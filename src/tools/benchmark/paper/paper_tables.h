#pragma once

#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

#include "tools/benchmark/measure.h"
#include "xray_registration/drr/device.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration::tools {

/// One registration of the paper's tables, as one implementation ran it.
struct PaperRun {
  double drr_ms = 0.0;    ///< Over all iterations.
  double other_ms = 0.0;  ///< Over all iterations.
  double total_ms = 0.0;
  std::vector<double> all_totals_ms;  ///< Of the repetitions that this one is the median of.
  int iterations = 0;
  bool converged = false;
  double angle_error_deg = 0.0;  ///< ‖θ − truth‖ / √3.
  double shift_error_mm = 0.0;   ///< The same of τ.
  double relative_error = 0.0;   ///< ‖s − truth‖ / ‖truth‖, the table's units.
};

/// What the paper printed, seconds; negative where it printed nothing.
struct PublishedTimes {
  double drr_s = -1.0;
  double other_s = -1.0;
  double total_s = -1.0;
  int iterations = -1;
};

struct PaperTableRow {
  std::string label;
  PaperRun cpp;
  PaperRun opencl;
  PublishedTimes published_cpp;
  PublishedTimes published_gpu;
};

/// Table I: the white cube at 16³ … 128³. C++ and OpenCL in turns, the median of `runs` registrations each.
std::vector<PaperTableRow> runTableOne(const std::shared_ptr<Device>& device, int runs);

/// Table II on a volume of 128×128×100.
std::vector<PaperTableRow> runTableTwo(const std::shared_ptr<Device>& device, const AttenuationVolume& volume,
                                       int runs);

/// Every choice that the paper leaves open.
void printChoices(std::ostream& out);
/// Times per iteration.
void printTableOne(std::ostream& out, const std::vector<PaperTableRow>& rows);
/// Times of whole registrations.
void printTableTwo(std::ostream& out, const std::string& volume, const std::vector<PaperTableRow>& rows);

/// registration/table2/paper/{cpp,opencl}/{2,4,6}.
std::vector<BenchmarkRow> rowsOfTableTwo(const std::string& prefix, const std::vector<PaperTableRow>& rows);
/// registration/table1/paper/{cpp,opencl}/{16 … 128}.
std::vector<BenchmarkRow> rowsOfTableOne(const std::vector<PaperTableRow>& rows);

}  // namespace xray_registration::tools
