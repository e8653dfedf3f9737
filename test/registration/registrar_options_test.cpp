#include "xray_registration/registration/registrar_options.h"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

namespace xray_registration {
namespace {

TEST(SolvesAlike, ThresholdsDoNotMatterAndEverythingElseDoes) {
  RegistrarOptions thresholds;
  thresholds.accept.min_similarity = 0.1;
  thresholds.accept.max_jump_mm = 1.0;
  thresholds.setup.focal_length = 0.1;
  thresholds.check_every = 7;
  EXPECT_TRUE(solvesAlike({}, thresholds));
  const std::vector<std::function<void(RegistrarOptions*)>> changes = {
      [](RegistrarOptions* o) { o->method = Method::kPaper; },
      [](RegistrarOptions* o) { o->similarity = Similarity::kGainOffset; },
      [](RegistrarOptions* o) { o->max_steps_per_frame += 1; },
      [](RegistrarOptions* o) { o->max_image_pixels += 1; },
      [](RegistrarOptions* o) { o->tracking_precision_mm += 1; },
      [](RegistrarOptions* o) { o->search = !o->search; },
      [](RegistrarOptions* o) { o->search_rotation_rad += 0.1; },
      [](RegistrarOptions* o) { o->search_translation_mm += 0.1; },
      [](RegistrarOptions* o) { o->search_poses += 1; },
      [](RegistrarOptions* o) { o->robust_weights = !o->robust_weights; },
      [](RegistrarOptions* o) { o->truncation_weights = !o->truncation_weights; },
      [](RegistrarOptions* o) { o->paper_max_iterations += 1; },
      [](RegistrarOptions* o) { o->paper_stop_norm += 0.1; },
      [](RegistrarOptions* o) { o->paper_step_deg += 0.1; },
      [](RegistrarOptions* o) { o->paper_step_mm += 0.1; },
      [](RegistrarOptions* o) { o->paper_image_size += 1; },
  };
  for (std::size_t i = 0; i < changes.size(); ++i) {
    RegistrarOptions changed;
    changes[i](&changed);
    EXPECT_FALSE(solvesAlike({}, changed)) << "change " << i;
  }
}

}  // namespace
}  // namespace xray_registration
