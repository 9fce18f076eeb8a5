// SPDX-License-Identifier: Apache-2.0
// A plugin of `facetwise prove` from scalar code: two functions of one lane.
#pragma once

#include "facetwise_plugin.h"

struct Vec {
  float x, y, z;
};
inline float dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

struct Drawn {
  Vec o{};
  float pdf = 0, weight = 0;
};
struct Asked {
  float pdf = 0, value = 0;
};

// To be defined: a BSDF's name, and what it does to one lane.
extern const char* const kName;
Drawn sample(Vec i, float ax, float ay, float u1, float u2, float u3);
Asked evaluate(Vec i, Vec o, float ax, float ay);

extern "C" const fw_plugin* fw_plugin_open() {
  static const fw_plugin plugin = {
      FW_PLUGIN_VERSION, kName,
      [](const fw_plugin_lanes* in, float* ox, float* oy, float* oz, float* pdf, float* weight) {
        for (size_t k = 0; k < in->count; ++k) {
          const Drawn d = sample({in->ix[k], in->iy[k], in->iz[k]}, in->alpha_x[k], in->alpha_y[k], in->u1[k],
                                 in->u2[k], in->u3[k]);
          ox[k] = d.o.x, oy[k] = d.o.y, oz[k] = d.o.z, pdf[k] = d.pdf, weight[k] = d.weight;
        }
      },
      [](const fw_plugin_lanes* in, float* pdf, float* value) {
        for (size_t k = 0; k < in->count; ++k) {
          const Asked a = evaluate({in->ix[k], in->iy[k], in->iz[k]}, {in->ox[k], in->oy[k], in->oz[k]}, in->alpha_x[k],
                                   in->alpha_y[k]);
          pdf[k] = a.pdf, value[k] = a.value;
        }
      }};
  return &plugin;
}
