// SPDX-License-Identifier: Apache-2.0
#include "tests/app/lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <sstream>

#include "tests/app/command.h"

namespace facetwise::test {

Lanes::Lanes(std::size_t count) {
  std::mt19937 random(11);
  const auto uniform = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  for (auto& column : columns) column.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    for (const int first : {0, 8}) {
      const float z = 1.0f - 1.3f * uniform(), phi = 6.2831853f * uniform(), r = std::sqrt(1.0f - z * z);
      columns[first][k] = r * std::cos(phi);
      columns[first + 1][k] = r * std::sin(phi);
      columns[first + 2][k] = z;
    }
    columns[3][k] = 0.01f + uniform();
    columns[4][k] = 0.01f + uniform();
    for (const int u : {5, 6, 7}) columns[u][k] = uniform();
    if (k % 50 == 3) columns[0][k] = std::numeric_limits<float>::quiet_NaN();
    if (k % 50 == 7) columns[3][k] = 5e-5f;
  }
}

std::string Lanes::csv(std::size_t names, std::size_t begin) const {
  std::ostringstream text;
  text.precision(9);
  for (std::size_t c = 0; c < names; ++c) text << (c ? "," : "") << kNames[c];
  text << "\n";
  for (std::size_t k = begin; k < size(); ++k) {
    for (std::size_t c = 0; c < names; ++c) text << (c ? "," : "") << columns[c][k];
    text << "\n";
  }
  return text.str();
}

std::string Lanes::npy() const {
  std::string header = "{'descr': [", records;
  for (std::size_t c = kColumns; c-- > 0;)
    header += std::string("('") + kNames[c] + "', '<f4'), " + (c % 3 == 0 ? "('', '|V4'), " : "");
  header += "], 'fortran_order': False, 'shape': (" + std::to_string(size()) + ",), }";
  for (std::size_t k = 0; k < size(); ++k)
    for (std::size_t c = kColumns; c-- > 0;) {
      append(records, columns[c][k]);
      if (c % 3 == 0) records += "\xff\xff\xff\xff";
    }
  return npy_file(header, records);
}

Batch Lanes::batch(Operation operation, Sampler sampler) const {
  Batch batch;
  batch.sampler = sampler;
  batch.lanes = size();
  batch.incident = {columns[0], columns[1], columns[2]};
  batch.alpha_x = columns[3];
  batch.alpha_y = columns[4];
  if (operation == Operation::sample_normal || operation == Operation::sample_reflection) {
    batch.u1 = columns[5];
    batch.u2 = columns[6];
    if (uses_u3({}, sampler)) batch.u3 = columns[7];
  } else if (has_sampler(operation)) {
    batch.outgoing = {columns[8], columns[9], columns[10]};
  }
  return batch;
}

const std::vector<float>& Output::operator[](const std::string& name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    ADD_FAILURE() << "no column " << name;
    static const std::vector<float> none;
    return none;
  }
  return columns[static_cast<std::size_t>(found - names.begin())];
}

Output read_output(const std::string& path) {
  const std::string bytes = read_file(path);
  Output output;
  if (bytes.substr(0, 6) == "\x93NUMPY") {
    // Float fields, then status and three bytes of padding.
    const std::size_t begin = 10 + static_cast<std::uint8_t>(bytes[8]) + 256 * static_cast<std::uint8_t>(bytes[9]);
    const std::string header = bytes.substr(0, begin);
    EXPECT_EQ(begin % 64, 0u);
    EXPECT_NE(header.find("('status', '|u1'), ('', '|V3')]"), std::string::npos) << header;
    for (std::size_t at = header.find("('"); at != std::string::npos; at = header.find("('", at + 1)) {
      const std::string name = header.substr(at + 2, header.find('\'', at + 2) - at - 2);
      if (!name.empty()) output.names.push_back(name);
    }
    const std::size_t stride = 4 * output.names.size();
    output.columns.resize(output.names.size());
    EXPECT_EQ((bytes.size() - begin) % stride, 0u);
    for (std::size_t at = begin; at < bytes.size(); at += stride)
      for (std::size_t c = 0; c < output.names.size(); ++c) {
        float value = static_cast<std::uint8_t>(bytes[at + 4 * c]);
        if (c + 1 < output.names.size()) std::memcpy(&value, &bytes[at + 4 * c], 4);
        output.columns[c].push_back(value);
      }
    return output;
  }
  std::istringstream text(bytes);
  std::string line, cell;
  std::getline(text, line);
  for (std::istringstream cells(line); std::getline(cells, cell, ',');) output.names.push_back(cell);
  output.columns.resize(output.names.size());
  while (std::getline(text, line)) {
    std::istringstream cells(line);
    for (auto& column : output.columns) {
      std::getline(cells, cell, ',');
      column.push_back(std::strtof(cell.c_str(), nullptr));
    }
  }
  return output;
}

}  // namespace facetwise::test
