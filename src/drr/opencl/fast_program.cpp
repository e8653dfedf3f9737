#include "xray_registration/drr/opencl/fast_program.h"

#include <set>

namespace xray_registration {

namespace kernels {
extern const char* const geometry;
extern const char* const plan;
extern const char* const march;
extern const char* const render;
extern const char* const derivatives;
extern const char* const tile_sums;
extern const char* const motion_sums;
extern const char* const body_sums;
extern const char* const windows;
extern const char* const xray_pyramid;
extern const char* const truncation;
extern const char* const match_shifts;
#define XRAY_SIMILARITY(enumerator, name, sums, span, finest_span, flat, contrast, description) \
  extern const char* const sums;
#include "xray_registration/drr/similarities.def"
#undef XRAY_SIMILARITY
}  // namespace kernels

namespace {

struct Part {
  const char* name;
  const char* text;
};

std::string textOf(const Part& part) { return std::string("#line 1 \"") + part.name + ".cl\"\n" + part.text + "\n"; }

}  // namespace

std::string fastSource() {
  // Each may use what stands before it.
  const Part parts[] = {
      {"geometry", kernels::geometry},
      {"plan", kernels::plan},
      {"march", kernels::march},
      {"render", kernels::render},
      {"derivatives", kernels::derivatives},
      {"tile_sums", kernels::tile_sums},
      {"motion_sums", kernels::motion_sums},
      {"body_sums", kernels::body_sums},
      {"windows", kernels::windows},
      {"xray_pyramid", kernels::xray_pyramid},
      {"truncation", kernels::truncation},
      {"match_shifts", kernels::match_shifts},
  };
  const Part sums[] = {
#define XRAY_SIMILARITY(enumerator, name, sums, span, finest_span, flat, contrast, description) {#sums, kernels::sums},
#include "xray_registration/drr/similarities.def"
#undef XRAY_SIMILARITY
  };
  std::string source;
  for (const Part& part : parts) source += textOf(part);
  std::set<std::string> taken;  // Several similarities may share a kernel.
  for (const Part& part : sums) source += taken.insert(part.name).second ? textOf(part) : "";
  return source;
}

std::string fastOptions(const MarchShape& shape) {
  return "-cl-std=CL1.2 -cl-mad-enable -cl-no-signed-zeros -DLANES=" + std::to_string(shape.lanes) +
         " -DSPLIT=" + std::to_string(shape.split) + " -DVOXELS_16=" + (shape.voxels_16 ? "1" : "0") +
         layout::layoutOptions();
}

}  // namespace xray_registration
