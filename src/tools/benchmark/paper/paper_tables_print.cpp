#include <algorithm>
#include <cstdio>
#include <ostream>

#include "tools/benchmark/paper/paper_tables.h"

namespace xray_registration::tools {
namespace {

/// A number of seconds, or a dash where the paper has none.
std::string seconds(double value) {
  if (value < 0.0) return "-";
  char text[32];
  std::snprintf(text, sizeof text, value < 0.0095 ? "%.5f" : value < 10.0 ? "%.3f" : "%.2f", value);
  return text;
}

void printLine(std::ostream& out, const char* volume, const char* what, const std::string& drr,
               const std::string& other, const std::string& total, const std::string& iterations,
               const std::string& error) {
  char line[160];
  std::snprintf(line, sizeof line, "  %-8s %-26s %10s %10s %10s %6s   %s\n", volume, what, drr.c_str(), other.c_str(),
                total.c_str(), iterations.c_str(), error.c_str());
  out << line;
}

void printRun(std::ostream& out, const std::string& label, const char* what, const PaperRun& run, double divisor) {
  char error[96];
  std::snprintf(error, sizeof error, "%.4f (%.3f deg, %.3f mm)%s", run.relative_error, run.angle_error_deg,
                run.shift_error_mm, run.converged ? "" : ", NOT CONVERGED");
  printLine(out, label.c_str(), what, seconds(run.drr_ms / divisor * 1e-3), seconds(run.other_ms / divisor * 1e-3),
            seconds(run.total_ms / divisor * 1e-3), std::to_string(run.iterations), error);
}

void printPublished(std::ostream& out, const char* what, const PublishedTimes& times) {
  printLine(out, "", what, seconds(times.drr_s), seconds(times.other_s), seconds(times.total_s),
            times.iterations < 0 ? "-" : std::to_string(times.iterations), "");
}

void printTable(std::ostream& out, const std::vector<PaperTableRow>& rows, const char* first_column, bool per_step) {
  printLine(out, first_column, "", "DRR [s]", "other [s]", "total [s]", "steps", "relative error");
  for (const PaperTableRow& row : rows) {
    printRun(out, row.label, "here, plain C++", row.cpp, per_step ? std::max(row.cpp.iterations, 1) : 1);
    printRun(out, "", "here, OpenCL", row.opencl, per_step ? std::max(row.opencl.iterations, 1) : 1);
    printPublished(out, "paper, C++ (3 GHz, 2007)", row.published_cpp);
    printPublished(out, "paper, GeForce 8800 GTX", row.published_gpu);
  }
  out << '\n';
}

}  // namespace

void printChoices(std::ostream& out) {
  out << "The paper's method as published: concentric-sphere ray casting with m = 3 Lz tri-linear samples, plain "
         "sums,\n"
         "sum of squared differences, Gauss-Newton with six forward-difference DRRs a step, 6x6 elimination on the\n"
         "host. Source 2.5 Lz before the volume's centre, plane 1.5 Lz behind it; start 0; the portal image is the\n"
         "implementation's own DRR at the truth. What the paper leaves open, and what was taken:\n"
         "  image                 N x N with the volume's N (Table II: 128 x 128)\n"
         "  plane                 twice as wide as the volume, so that all of it is in view\n"
         "  rotations             Rz Ry Rx about the volume's centre, in the camera's axes\n"
         "  finite differences    2 degrees and 0.05 cube sides (Table I); 0.5 degrees and 0.5 mm (Table II)\n"
         "  stopping rule         norm of the step in degrees and cube sides (Table I, 0.1), degrees and mm "
         "(Table II, 0.8)\n"
         "  spheres               m midpoints over the ball around the volume; outside the volume is air\n"
         "  white cube            the middle half of each axis of the volume is white, the rest air\n"
         "  relative error        length of the error of s over the length of s, in the table's units\n"
         "  timing                one thread in C++ (which skips samples outside the volume); the device is waited "
         "for\n"
         "                        after the seven DRRs of a step, all else of the step is 'other'\n\n";
}

void printTableOne(std::ostream& out, const std::vector<PaperTableRow>& rows) {
  out << "Table I: white cube, truth (5, 5, 5) degrees and (0.1, 0.1, 0.1) cube sides; seconds per iteration\n";
  printTable(out, rows, "volume", true);
}

void printTableTwo(std::ostream& out, const std::string& volume, const std::vector<PaperTableRow>& rows) {
  out << "Table II: " << volume << ", 128x128x100, truth t degrees and t mm each; seconds of the whole registration\n";
  printTable(out, rows, "t", false);
}

}  // namespace xray_registration::tools
