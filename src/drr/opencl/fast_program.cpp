#include "xray_registration/drr/opencl/fast_program.h"

namespace xray_registration {

namespace kernels {
extern const char* const geometry;
extern const char* const plan;
extern const char* const march;
extern const char* const render;
extern const char* const derivatives;
extern const char* const tile_sums;
extern const char* const windows;
extern const char* const xray_pyramid;
extern const char* const truncation;
}  // namespace kernels

std::string fastSource() {
  struct Part {
    const char* name;
    const char* text;
  };
  // Each may use what stands before it.
  const Part parts[] = {
      {"geometry.cl", kernels::geometry},
      {"plan.cl", kernels::plan},
      {"march.cl", kernels::march},
      {"render.cl", kernels::render},
      {"derivatives.cl", kernels::derivatives},
      {"tile_sums.cl", kernels::tile_sums},
      {"windows.cl", kernels::windows},
      {"xray_pyramid.cl", kernels::xray_pyramid},
      {"truncation.cl", kernels::truncation},
  };
  std::string source;
  for (const Part& part : parts) source += std::string("#line 1 \"") + part.name + "\"\n" + part.text + "\n";
  return source;
}

std::string fastOptions(const MarchShape& shape) {
  return "-cl-std=CL1.2 -cl-mad-enable -cl-no-signed-zeros -DLANES=" + std::to_string(shape.lanes) +
         " -DSPLIT=" + std::to_string(shape.split) + layout::layoutOptions();
}

}  // namespace xray_registration
