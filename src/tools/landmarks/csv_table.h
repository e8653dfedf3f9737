#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace xray_registration::tools {

/// A table of text with named columns. Lines that begin with # and empty ones are left out; cells lose the blanks and
/// quotes around them.
class CsvTable {
 public:
  /// @throws std::runtime_error naming the file: it cannot be read, has no line of names, or a line of another length.
  explicit CsvTable(const std::string& path);

  std::size_t rows() const { return rows_.size(); }
  bool has(const std::string& column) const { return columns_.count(column) > 0; }
  /// Empty when there is no such column.
  std::string text(std::size_t row, const std::string& column) const;
  /// @throws std::runtime_error naming file, line and column when it is no number.
  double number(std::size_t row, const std::string& column) const;

 private:
  struct Row {
    int line = 0;
    std::vector<std::string> cells;
  };

  std::string path_;
  std::map<std::string, std::size_t> columns_;
  std::vector<Row> rows_;
};

/// "a, "b",c" → {a, b, c}
std::vector<std::string> csvCells(const std::string& line);

}  // namespace xray_registration::tools
