#include "tools/common/json_files.h"

#include <fstream>
#include <stdexcept>

namespace xray_registration::tools {

nlohmann::json toJson(const RigidTransform& transform) {
  const Eigen::Matrix4d& matrix = transform.matrix();
  nlohmann::json rows = nlohmann::json::array();
  for (int row = 0; row < 4; ++row) {
    rows.push_back({matrix(row, 0), matrix(row, 1), matrix(row, 2), matrix(row, 3)});
  }
  return rows;
}

RigidTransform rigidFromJson(const nlohmann::json& rows) {
  Eigen::Matrix4d matrix;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      matrix(row, column) = rows.at(static_cast<std::size_t>(row)).at(static_cast<std::size_t>(column)).get<double>();
    }
  }
  return rigidFromMatrix(matrix);
}

nlohmann::json toJson(const Percentiles& values) {
  return {{"median", values.median}, {"p95", values.p95}, {"p99", values.p99}};
}

nlohmann::json toJson(const std::vector<SetupSuspicion>& suspicions) {
  nlohmann::json list = nlohmann::json::array();
  for (const SetupSuspicion& suspicion : suspicions) {
    list.push_back({{"what", suspicion.what},
                    {"in_words", suspicion.in_words},
                    {"estimate", suspicion.estimate},
                    {"sigma", suspicion.sigma},
                    {"unit", suspicion.unit},
                    {"effect_mm", suspicion.effect_mm},
                    {"certain", suspicion.certain}});
  }
  return list;
}

void writeJson(const std::string& path, const nlohmann::json& value) {
  std::ofstream stream(path);
  stream << value.dump(1) << '\n';
  if (!stream.flush()) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace xray_registration::tools
