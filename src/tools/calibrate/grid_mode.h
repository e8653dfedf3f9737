#pragma once

#include <string>

namespace xray_registration::tools {

struct GridArguments {
  std::string image;
  std::string output;       ///< Folder; made if need be.
  std::string json;         ///< Empty: none.
  double spacing_mm = 0.0;  ///< Of neighbouring marks; 0 when it is not known.
};

/// Makes an undistortion map and a picture of it from a picture of a grid, and prints how good it is.
/// @throws std::runtime_error naming the file that is of no use and why.
void calibrateFromGrid(const GridArguments& arguments);

}  // namespace xray_registration::tools
