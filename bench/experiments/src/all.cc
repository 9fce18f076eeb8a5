#include "src/all.h"

#include <chrono>

namespace facetwise::experiments {

std::vector<Experiment> all_experiments() {
  return {{"wasted", "Wasted samples and the range of weights", wasted_page},
          {"bounded", "Bounded and exact sampling of reflections", bounded_page}};
}

}  // namespace facetwise::experiments
