// SPDX-License-Identifier: Apache-2.0
// Runs a range of a plan's lanes, tile by tile. Contiguous columns are used where they lie; the others, and lanes that
// do not fill a vector, go by way of buffers.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "src/plan.h"

namespace facetwise {

// Lanes of a tile with buffers, which then stay in the first-level cache, and of one without.
inline constexpr std::size_t kStaged = 512, kInPlace = 4096;
static_assert(kStaged % kWidest == 0 && kInPlace % kWidest == 0 && kWidest % kLine == 0);

class Stage {
 public:
  explicit Stage(const Plan& plan) : plan_(plan), tile_(plan.constants) {
    const std::size_t filled = std::min((plan.positions + kWidest - 1) / kWidest * kWidest, kStaged);
    for (std::size_t c = 0; c < plan.one_value_count; ++c) {
      const auto& [k, value] = plan.one_value[c];
      std::fill_n(in_[k], filled, value);
      tile_.in[k] = in_[k];
    }
  }

  // Runs the positions [begin, end) of the batch, or of its active list.
  Statistics run(std::size_t begin, std::size_t end) {
    Statistics statistics;
    const std::size_t most = plan_.buffers ? kStaged : kInPlace;
    while (begin < end) {
      if (plan_.stop != nullptr && plan_.stop->load(std::memory_order_relaxed)) break;
      const bool head = begin < plan_.head;
      std::size_t lanes = std::min(head ? plan_.head - begin : most, end - begin);
      const bool whole = lanes >= kWidest && !head;
      if (whole) lanes -= lanes % kWidest;
      if (!whole) lanes = std::min(lanes, kStaged);
      tile_.lanes = lanes;
      const bool in_place = whole && !plan_.active && !plan_.lobe;
      load(begin, in_place);
      if (plan_.generator) generate(begin);
      const bool staged = point_outputs(begin, in_place);
      if (plan_.ahead) point_ahead(begin, in_place);
      if (plan_.lobe) {
        run_with_lobe(statistics);
      } else {
        if (plan_.compensation) compute_factors();
        plan_.kernel(tile_, statistics);
        if (plan_.compensation) apply_factors();
      }
      if (staged) store(begin);
      begin += lanes;
    }
    return statistics;
  }

 private:
  std::size_t lane_at(std::size_t position) const { return plan_.active ? plan_.active[position] : position; }
  // The buffers are read up to the next whole vector: zeros, which make an invalid lane.
  std::size_t padding() const { return (kWidest - tile_.lanes % kWidest) % kWidest; }

  void load(std::size_t begin, bool in_place) {
    for (std::size_t c = 0; c < plan_.per_lane_count; ++c) {
      const auto& [k, column, contiguous] = plan_.per_lane[c];
      if (in_place && contiguous) {
        tile_.in[k] = column->data() + begin;
        continue;
      }
      if (contiguous) {
        std::copy_n(column->data() + begin, tile_.lanes, in_[k]);
      } else {
        for (std::size_t j = 0; j < tile_.lanes; ++j) in_[k][j] = (*column)[lane_at(begin + j)];
      }
      std::fill_n(in_[k] + tile_.lanes, padding(), 0.0f);
      tile_.in[k] = in_[k];
    }
  }

  void generate(std::size_t begin) {
    const Generator& generator = *plan_.generator;
    PhiloxTile philox{.lanes = tile_.lanes,
                      .seed = generator.seed,
                      .dimension = generator.dimension,
                      .first_id = generator.first_id + begin};
    if (generator.id.present() || plan_.active) {
      for (std::size_t j = 0; j < tile_.lanes; ++j) {
        const std::size_t lane = lane_at(begin + j);
        id_[j] = generator.first_id + lane;
        if (generator.id.present())  // 4-byte alignment is enough for a column
          std::memcpy(&id_[j], reinterpret_cast<const char*>(generator.id.data()) + lane * generator.id.lane_stride(),
                      sizeof id_[j]);
      }
      std::fill_n(id_ + tile_.lanes, padding(), 0);
      philox.id = id_;
    }
    philox.u[0] = in_[kU1];
    philox.u[1] = in_[kU2];
    philox.u[2] = plan_.generates_u3 ? in_[kU3] : nullptr;
    plan_.table->philox(philox);
    for (const InputIndex k : {kU1, kU2, kU3}) tile_.in[k] = in_[k];
  }

  // Returns true if an output goes by way of a buffer.
  bool point_outputs(std::size_t begin, bool in_place) {
    bool staged = false;
    tile_.streamed = in_place ? plan_.streamed : 0;
    for (std::size_t c = 0; c < plan_.out_count; ++c) {
      const auto& [k, column, contiguous] = plan_.out[c];
      const bool direct = in_place && contiguous;
      tile_.out[k] = direct ? column->data() + begin : out_[k];
      staged |= !direct;
    }
    for (std::size_t k = 0; k < kByteOutputs; ++k) {
      if (plan_.bytes[k] == nullptr) continue;
      const OutputColumn<std::uint8_t>& column = *plan_.bytes[k];
      const bool direct = in_place && column.stride() == 1;
      (k == kOutStatus ? tile_.status : tile_.event) = direct ? column.data() + begin : bytes_[k];
      staged |= !direct;
    }
    return staged;
  }

  // Each column at a distance of its own; beyond a column's end nothing happens.
  void point_ahead(std::size_t begin, bool in_place) {
    constexpr std::size_t kFirst = 4 * kLine, kStep = 8 * kLine;
    tile_.ahead = ahead_;
    tile_.ahead_count = 0;
    if (!in_place) return;
    const auto add = [&](const float* data) {
      const std::size_t distance = kFirst + kStep * tile_.ahead_count;
      ahead_[tile_.ahead_count++] = data + begin + distance;
    };
    for (std::size_t c = 0; c < plan_.per_lane_count; ++c)
      if (plan_.per_lane[c].contiguous) add(plan_.per_lane[c].column->data());
    for (std::size_t c = 0; c < plan_.out_count; ++c)
      if (plan_.out[c].contiguous && !(plan_.streamed & 1u << plan_.out[c].index)) add(plan_.out[c].column->data());
  }

  // Before the kernel runs, whose outputs may lie over its inputs.
  void compute_factors() {
    tile_.factor = factor_;
    Statistics counted_by_the_kernel;
    plan_.compensation(tile_, counted_by_the_kernel);
  }
  void apply_factors() {
    float* const out = tile_.out[plan_.compensated];
    for (std::size_t j = 0; j < tile_.lanes; ++j) out[j] = std::min(out[j] * factor_[j], kLargestDensity);
  }

  // Kelemen's lobe beside the model's own. All columns are in buffers.
  void run_with_lobe(Statistics& statistics) {
    for (std::size_t k = 0; k < kLobeColumns; ++k) tile_.lobe[k] = lobe_[k];
    tile_.status = bytes_[kOutStatus];
    const bool draws = tile_.draws_lobe;
    plan_.lobe(tile_, statistics);
    Tile own = tile_;
    if (draws) {
      own.in[kU1] = lobe_[kLobeU1];
      own.in[kU3] = lobe_[kLobeU3];
      for (const OutputIndex k : {kOutOx, kOutOy, kOutOz, kOutPdf, kOutWeight}) own.out[k] = out_[k];
    }
    plan_.kernel(own, statistics);
    take(draws, statistics);
    if (draws) {
      Tile query = own;
      query.wanted = kWantsPdf | kWantsValue;
      query.out[kOutPdf] = lobe_[kLobePdf];
      query.out[kOutValue] = lobe_[kLobeValue];
      query.status = nullptr;
      const InputIndex in[] = {kOx, kOy, kOz};
      const OutputIndex out[] = {kOutOx, kOutOy, kOutOz};
      for (int c = 0; c < 3; ++c) query.in[in[c]] = own.in[in[c]] = out_[out[c]];
      Statistics counted_by_the_sampler;
      plan_.lobe_query(query, counted_by_the_sampler);
    }
    plan_.with_lobe(own, statistics);
  }
  // Which lanes have the lobe, and by which they are drawn. What the lobe draws is never occluded.
  void take(bool draws, Statistics& statistics) {
    float* const taken = lobe_[kLobeTaken];
    std::uint8_t* const status = bytes_[kOutStatus];
    constexpr auto kAccepted = static_cast<std::uint8_t>(LaneStatus::accepted);
    constexpr auto kOccluded = static_cast<std::uint8_t>(LaneStatus::occluded);
    for (std::size_t j = 0; j < tile_.lanes; ++j) {
      if (!draws || taken[j] == 0 || status[j] > kOccluded) {
        taken[j] = status[j] == kAccepted ? 1 : 0;
        continue;
      }
      taken[j] = 2;
      statistics.occluded -= status[j] == kOccluded ? 1 : 0;
      status[j] = kAccepted;
      out_[kOutOx][j] = lobe_[kLobeX][j];
      out_[kOutOy][j] = lobe_[kLobeY][j];
      out_[kOutOz][j] = lobe_[kLobeZ][j];
    }
    std::fill_n(taken + tile_.lanes, padding(), 0.0f);
  }

  void store(std::size_t begin) {
    for (std::size_t c = 0; c < plan_.out_count; ++c) {
      const auto& [k, column, contiguous] = plan_.out[c];
      if (tile_.out[k] != out_[k]) continue;
      if (contiguous) {
        std::copy_n(out_[k], tile_.lanes, column->data() + begin);
      } else {
        for (std::size_t j = 0; j < tile_.lanes; ++j) (*column)[lane_at(begin + j)] = out_[k][j];
      }
    }
    for (std::size_t k = 0; k < kByteOutputs; ++k) {
      if (plan_.bytes[k] == nullptr || (k == kOutStatus ? tile_.status : tile_.event) != bytes_[k]) continue;
      for (std::size_t j = 0; j < tile_.lanes; ++j) (*plan_.bytes[k])[lane_at(begin + j)] = bytes_[k][j];
    }
  }

  const Plan& plan_;
  Tile tile_;
  const float* ahead_[std::size_t{kInputs} + kOutputs];
  alignas(64) float in_[kInputs][kStaged];
  alignas(64) float out_[kOutputs][kStaged];
  alignas(64) float factor_[kStaged];
  alignas(64) float lobe_[kLobeColumns][kStaged];
  alignas(64) std::uint8_t bytes_[kByteOutputs][kStaged];
  alignas(64) std::uint64_t id_[kStaged];
};

}  // namespace facetwise
