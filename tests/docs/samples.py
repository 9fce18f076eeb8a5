#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The code that the pages show, as programs. samples.py cpp|c|python PAGE ...: prints one of all blocks in that language; `python`
runs them instead."""
import re
import sys

CPP = """#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>
static const std::size_t paths = 1000;
%s
int main() {
  std::vector<Path> some(100, Path{{0.6f, 0, 0.8f}, 0.3f, {}, 0, 0});
  if (!scatter(some, 1).ok() || !(some[7].pdf > 0) || !(some[7].weight > 0)) return 1;
  ix[paths - 1] = 1;
  facetwise::Batch batch;
  batch.lanes = 1000;
  batch.incident = {0.6f, 0.0f, 0.8f};
  batch.alpha_x = batch.alpha_y = 0.3f;
  batch.generator = {.seed = 1};
  batch.out.weight = {ix, paths};
  if (!(nanoseconds(batch, facetwise::Target::scalar) > 0)) return 1;
  // Its servers are not there.
  return scatter_remotely(batch).ok() ? 1 : 0;
}
"""

C = """#include <stdint.h>
#include <stdio.h>
#include "facetwise.h"
enum { lanes = 100 };
int main(void) {
  static float ix[lanes], iy[lanes], iz[lanes], weight[lanes];
  const uint64_t seed = 1;
  for (int k = 0; k < lanes; ++k) ix[k] = 0.6f, iz[k] = 0.8f;
#define fw_set_generator if (fw_set_input(batch, "incident.y", iy, lanes, 0) != FW_OK || \\
    fw_set_input(batch, "incident.z", iz, lanes, 0) != FW_OK || fw_set_value(batch, "alpha_y", 0.3f) != FW_OK) return 2; \\
  fw_set_generator
%s
  for (int k = 0; k < lanes; ++k) if (!(weight[k] > 0)) return 1;
  return 0;
}
"""


def blocks(language, pages):
    for page in pages:
        with open(page, encoding="utf-8") as file:
            yield from re.findall(rf"^```{language}\n(.*?)^```$", file.read(), re.M | re.S)


language, pages = sys.argv[1], sys.argv[2:]
if language == "python":
    import dask.array
    import numpy as np

    def radiance(outgoing):
        return outgoing[:, 2]

    found = list(blocks("python", pages))
    assert len(found) >= 2, "no code found"
    for code in found:
        lazy = "dask" in code
        place = dict(radiance=radiance, directions=np.tile(np.float32([0.6, 0, 0.8]), (1000, 1)), alpha=np.full(1000, 0.3))
        if lazy:
            place.update({name: dask.array.from_array(place[name]) for name in ("directions", "alpha")})
        exec(code, place)
        assert 0.1 < float(place["light"]) < 1, place["light"]
else:
    found = "\n".join(blocks(language, pages))
    assert found, "no code found"
    print({"cpp": CPP, "c": C}[language] % found)
