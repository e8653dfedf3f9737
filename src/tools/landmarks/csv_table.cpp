#include "tools/landmarks/csv_table.h"

#include <cmath>
#include <fstream>
#include <stdexcept>

namespace xray_registration::tools {
namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw std::runtime_error(path + ": " + what);
}

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r\"");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t\r\"") - first + 1);
}

}  // namespace

std::vector<std::string> csvCells(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (c == ',' && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  for (std::string& cell : cells) cell = trimmed(cell);
  return cells;
}

CsvTable::CsvTable(const std::string& path) : path_(path) {
  std::ifstream stream(path);
  if (!stream) refuse(path, "cannot be read");
  int number = 0;
  std::size_t width = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    if (trimmed(line).empty() || trimmed(line).front() == '#') continue;
    const auto cells = csvCells(line);
    if (columns_.empty()) {
      for (std::size_t i = 0; i < cells.size(); ++i) {
        const bool is_new = columns_.emplace(cells[i], i).second;
        if (!is_new && !cells[i].empty()) refuse(path, "its first line names the column " + cells[i] + " twice");
      }
      width = cells.size();
      continue;
    }
    if (cells.size() != width) {
      refuse(path, "line " + std::to_string(number) + " has " + std::to_string(cells.size()) +
                       " cells, the first line " + std::to_string(width));
    }
    rows_.push_back({number, cells});
  }
  if (columns_.empty()) refuse(path, "is empty; the first line names the columns");
}

std::string CsvTable::text(std::size_t row, const std::string& column) const {
  const auto found = columns_.find(column);
  return found == columns_.end() ? "" : rows_.at(row).cells[found->second];
}

double CsvTable::number(std::size_t row, const std::string& column) const {
  const std::string cell = text(row, column);
  std::size_t used = 0;
  double value = 0.0;
  try {
    value = std::stod(cell, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != cell.size() || !std::isfinite(value)) {
    refuse(path_,
           "line " + std::to_string(rows_.at(row).line) + ": '" + cell + "' in column " + column + " is not a number");
  }
  return value;
}

}  // namespace xray_registration::tools
