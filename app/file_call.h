// SPDX-License-Identifier: Apache-2.0
// A batch call on files: a table's columns are the lanes' inputs and outputs.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "app/table/table.h"
#include "facetwise/engine.h"

namespace facetwise::app {

struct FileCall {
  Operation operation = Operation::sample_reflection;
  Model model;
  std::optional<Sampler> sampler;     // nothing: default_sampler() of the model and the columns
  std::vector<float> alpha;           // alpha_x, and alpha_y if it differs, for all lanes; else columns
  std::optional<float> eta, f0, f90;  // for all lanes; else columns
  std::optional<std::uint64_t> seed;  // of the generator; else columns u1, u2, u3
  std::uint64_t first_id = 0;
  std::string input = "-", output = "-";
  std::vector<std::string> columns;  // names of a plain .npy array's columns
  bool normalise = false;            // directions to unit length first
};

struct FileCallResult {
  Statistics statistics;
  Sampler sampler;                   // that was used
  std::vector<std::string> ignored;  // columns that facetwise knows and this call does not read
  std::vector<std::string> passed;   // columns that it does not know, which are in the output as they were
  std::size_t backfacing = 0;        // lanes with i_z <= 0
  double seconds = 0;                // of the call, without reading and writing
};

// Reads the input, runs the call and writes the output: all of it or, on an error, nothing.
absl::StatusOr<FileCallResult> run_on_files(const FileCall& call, Engine& engine);

}  // namespace facetwise::app
