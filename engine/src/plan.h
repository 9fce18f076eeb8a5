// SPDX-License-Identifier: Apache-2.0
// A checked call and the kernel for it: all that is decided once, before the first lane.
#pragma once

#include <cstddef>
#include <cstdint>

#include "facetwise/batch.h"
#include "src/fields.h"
#include "src/tile.h"

namespace facetwise {

struct Plan {
  const TargetKernels* table = nullptr;
  Kernel kernel = nullptr;
  std::size_t positions = 0;  // lanes, or entries of the active list
  const std::atomic<bool>* stop = nullptr;
  const std::uint32_t* active = nullptr;
  const Generator* generator = nullptr;
  bool generates_u3 = false;
  TileConstants constants;
  // Lanes before most columns' first whole cache line. They are run by way of buffers, so that every later tile begins
  // on a line: columns from malloc share one place in their lines.
  std::size_t head = 0;
  unsigned streamed = 0;               // Tile::streamed of tiles that begin at `head` or a multiple of kLine beyond
  bool ahead = false;                  // inputs, and outputs that are not streamed, are fetched ahead
  Kernel compensation = nullptr;       // runs before `kernel`
  OutputIndex compensated = kOutputs;  // what its factors are for; kOutputs: there is none
  // Kelemen's lobe: before and after `kernel`, and the model's own query of what the lobe has drawn.
  Kernel lobe = nullptr, with_lobe = nullptr, lobe_query = nullptr;
  bool buffers = false;  // some column goes by way of buffers in every tile

  // The columns that there are, by the tile's indices.
  struct Input {
    unsigned index;
    const Column<float>* column;
    bool contiguous;
  };
  struct OneValue {
    unsigned index;
    float value;
  };
  struct Output {
    unsigned index;
    const OutputColumn<float>* column;
    bool contiguous;
  };
  Input per_lane[kInputs];
  OneValue one_value[kInputs];
  Output out[kOutputs];
  std::size_t per_lane_count = 0, one_value_count = 0, out_count = 0;
  const OutputColumn<std::uint8_t>* bytes[kByteOutputs] = {};  // null: absent
};

// The output that a call's compensation changes, for Plan::compensated.
OutputIndex compensated_output(Operation operation, const Model& model, const PresentColumns& columns);

// Makes what the caller has not: `compensated`, and the table of albedo that it or the operation needs. The batch is
// checked; it and `columns` live as long as the plan. `spreads`: over several threads.
void make_plan(Operation operation, const Batch& batch, const PresentColumns& columns, const TargetKernels& table,
               bool spreads, const Execution& execution, Plan& plan);

}  // namespace facetwise
