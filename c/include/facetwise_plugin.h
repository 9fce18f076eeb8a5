/* A BSDF for `facetwise prove PLUGIN.so`: a shared library that exports fw_plugin_open(). It samples and evaluates lanes in
 * columns; everything is in the local frame, z the shading normal, directions of unit length that point away from the surface.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef FACETWISE_PLUGIN_H_
#define FACETWISE_PLUGIN_H_

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FW_PLUGIN_VERSION 1

/* `count` values each. What a BSDF does not need it does not read. */
typedef struct fw_plugin_lanes {
  size_t count;
  const float *ix, *iy, *iz;       /* the known direction */
  const float *alpha_x, *alpha_y;  /* roughness */
  const float *u1, *u2, *u3;       /* of sample(): uniform in [0, 1) */
  const float *ox, *oy, *oz;       /* of evaluate(): the direction asked about */
} fw_plugin_lanes;

typedef struct fw_plugin {
  uint32_t version; /* FW_PLUGIN_VERSION */
  const char* name;
  /* Draws a direction o for each lane: its pdf (1/sr; 0: nothing was drawn) and its weight f |cos(theta_o)| / pdf. */
  void (*sample)(const fw_plugin_lanes* in, float* ox, float* oy, float* oz, float* pdf, float* weight);
  /* The pdf with which sample() draws o, and the value f |cos(theta_o)|. */
  void (*evaluate)(const fw_plugin_lanes* in, float* pdf, float* value);
} fw_plugin;

/* NULL: it cannot be used. What it points to stays valid. */
const fw_plugin* fw_plugin_open(void);

#ifdef __cplusplus
}
#endif

#endif
