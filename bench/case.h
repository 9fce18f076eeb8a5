// SPDX-License-Identifier: Apache-2.0
// One benchmark: what is measured, by which implementation, on what inputs.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "facetwise/bench.h"

namespace facetwise::bench {

enum class Implementation { scalar, auto_vectorised, one_lane, simd, simd_threads, remote };
// BenchResult::inputs says what they are.
enum class Inputs { columns, malloc_placed, fresh, one_roughness, generator, backfacing };

std::string_view name(Implementation);
std::string_view name(Inputs);

// Lanes that a stream of fresh columns goes through before it comes back to the first: far beyond every cache.
inline constexpr std::size_t kFreshLanes = std::size_t{1} << 24;

// The table of slopes of all cases with one, of default size: built when it is first asked for, in a second.
const std::shared_ptr<const SlopeTable>& measured_table();

// Roughness that differs from lane to lane, evenly spread over [0.05, 1]^2, is alpha_x = alpha_y = 0 here.
struct Case {
  Operation operation = Operation::sample_reflection;
  Distribution distribution = Distribution::ggx;
  Masking masking = Masking::smith;
  std::optional<Sampler> sampler;  // nothing where it is not read: evaluate_reflection then gives no pdf
  float alpha_x = 0, alpha_y = 0;
  std::size_t batch = 65536;
  Implementation implementation = Implementation::simd;
  Inputs inputs = Inputs::columns;

  bool is_sampling() const { return samples(operation); }
  // Of a dielectric; the others' interface is a conductor.
  bool scatters() const { return facetwise::scatters(operation); }
  bool has_outgoing() const { return !is_sampling() && has_sampler(operation); }  // among its inputs
  bool is_mixed() const { return alpha_x == 0; }
  // Lanes of the columns that it goes through.
  std::size_t lanes() const { return inputs == Inputs::fresh ? kFreshLanes : batch; }
  bool is_ggx_smith() const { return distribution == Distribution::ggx && masking == Masking::smith; }
  Model model() const {
    return {.distribution = distribution,
            .masking = masking,
            .interface = scatters() ? Interface::dielectric : Interface::conductor,
            .table = distribution == Distribution::table ? measured_table() : nullptr};
  }
  bool uses_u3() const {
    return is_sampling() && (operation == Operation::sample_scattering || facetwise::uses_u3(model(), *sampler));
  }
  // Float columns with a value per lane that are read, and that are written.
  int input_columns() const;
  int output_columns() const;
  // True if `other` differs only in the implementation, so that their times make a ratio.
  bool comparable(const Case& other) const;
};

// The result of a case, with everything but its measurements filled in.
BenchResult describe(const Case& which);

// What options.suite and options.filter choose, comparable cases together; remote ones only if there is a
// server. InvalidArgument for a filter that is not a regular expression or matches nothing.
absl::StatusOr<std::vector<Case>> choose_cases(const BenchOptions& options);

// Floating-point operations of a lane with i_z > 0 that ends up accepted, counted by hand from the kernels'
// formulas: + - * / and sqrt are one, a fused multiply-add two; comparisons, selects, integers (random
// numbers) and conversions are not counted. 0 where nobody has counted: models besides GGX with Smith, and scattering.
int flops(const Case& which);

}  // namespace facetwise::bench
