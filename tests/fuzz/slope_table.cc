// SPDX-License-Identifier: Apache-2.0
// The bytes of tables: of slopes and of albedo. What is taken is used.
#include "facetwise/slope_table.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "facetwise/albedo_table.h"
#include "facetwise/engine.h"
#include "src/table/layout.h"

namespace {

void sample(const facetwise::Model& model) {
  float u[16], weight[16], z[16];
  for (int k = 0; k < 16; ++k) u[k] = static_cast<float>(k) / 16, z[k] = 0.8f;
  facetwise::Batch batch;
  batch.model = model;
  batch.sampler = facetwise::Sampler::visible;
  batch.lanes = 16;
  batch.incident = {0.6f, 0.0f, {z, 16}};
  batch.alpha_x = batch.alpha_y = 0.5f;
  batch.u1 = batch.u2 = {u, 16};
  batch.out.weight = {weight, 16};
  if (!facetwise::sample_reflection(batch, {.threads = facetwise::Threads::one}).ok()) std::abort();
  for (const float w : weight)
    if (!(w >= 0) || std::isinf(w)) std::abort();
}

}  // namespace

// A changed table gets the hash that it must have, else nothing would come past it.
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most) __attribute__((weak));
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned) {
  constexpr std::size_t kHash = sizeof(std::uint64_t);
  size = LLVMFuzzerMutate(data, size > kHash ? size - kHash : size, most - kHash);
  const std::uint64_t hash = facetwise::fnv1a(data, size);
  std::memcpy(data + size, &hash, kHash);
  return size + kHash;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (const auto table = facetwise::SlopeTable::parse(bytes); table.ok()) {
    facetwise::Model model;
    model.distribution = facetwise::Distribution::table;
    model.table = *table;
    sample(model);
  }
  (void)facetwise::AlbedoTable::parse(bytes);
  return 0;
}
