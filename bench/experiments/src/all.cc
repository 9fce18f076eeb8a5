// SPDX-License-Identifier: Apache-2.0
#include "src/all.h"

namespace facetwise::experiments {

std::vector<Experiment> all_experiments() {
  return {{"wasted", "Wasted samples and the range of weights", wasted_page},
          {"bounded", "Bounded and exact sampling of reflections", bounded_page},
          {"backfacing", "Shading normals that face away", backfacing_page},
          {"convergence", "Visible normals: convergence, and rough glass", convergence_page},
          {"retro", "Reflecting back: the back vector", retro_page},
          {"relief", "A displaced surface from afar", relief_page},
          {"renderer", "What a renderer gains", renderer_page}};
}

}  // namespace facetwise::experiments
