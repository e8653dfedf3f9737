#pragma once

#include "xray_registration/registration/registrar_options.h"

namespace xray_registration {

/// One stage of the coarse-to-fine descent.
struct Stage {
  int level = 0;  ///< X-ray pyramid level, 0 fine.
  int span = 2;   ///< Of the windows, in tiles; 0 is one window over everything.
  int max_steps = 10;
};

/// Windows above the finest level.
inline int coarseSpan(Similarity similarity) { return kindOf(similarity).span; }

/// Small windows where the pose is already close: they follow scatter and shading best.
inline int finestSpan(Similarity similarity) { return kindOf(similarity).finest_span; }

inline Stage stageOn(int level, int max_steps, Similarity similarity) {
  return {level, level == 0 ? finestSpan(similarity) : coarseSpan(similarity), max_steps};
}

}  // namespace xray_registration
