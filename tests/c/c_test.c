/* SPDX-License-Identifier: Apache-2.0 */
/* The C interface from C: every operation, errors by name, tables, generators, active lanes; with an address the same calls
 * on a server, which give the same bits. c_test [ADDRESS] */
#include <facetwise.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;
#define EXPECT(condition)                                                                         \
  do {                                                                                            \
    if (!(condition)) {                                                                           \
      fprintf(stderr, "%s:%d: %s; last error: %s\n", __FILE__, __LINE__, #condition, fw_error()); \
      ++failures;                                                                                 \
    }                                                                                             \
  } while (0)
#define EXPECT_ERROR(call, code, start)                     \
  do {                                                      \
    EXPECT((call) == (code));                               \
    EXPECT(strncmp(fw_error(), start, strlen(start)) == 0); \
  } while (0)

enum { kLanes = 1000 };
static float ix[kLanes], iy[kLanes], iz[kLanes], ox[kLanes], oy[kLanes], oz[kLanes];
static float out[2][8][kLanes];
static uint8_t status[2][kLanes];

static fw_batch* ordinary(void) {
  fw_batch* batch = fw_batch_create(kLanes);
  EXPECT(fw_set_input(batch, "incident.x", ix, kLanes, 0) == FW_OK);
  EXPECT(fw_set_input(batch, "incident.y", iy, kLanes, 0) == FW_OK);
  EXPECT(fw_set_input(batch, "incident.z", iz, kLanes, 0) == FW_OK);
  EXPECT(fw_set_value(batch, "alpha_x", 0.4f) == FW_OK);
  EXPECT(fw_set_value(batch, "alpha_y", 0.2f) == FW_OK);
  return batch;
}

/* What each operation needs and writes. */
struct call {
  const char* operation;
  const char* interface;
  int samples, queries;
  const char* outputs[4];
};
static const struct call calls[] = {
    {"sample_normal", "conductor", 1, 0, {"out.normal.x", "out.normal.z", "out.pdf", NULL}},
    {"sample_reflection", "schlick", 1, 0, {"out.outgoing.x", "out.outgoing.z", "out.weight", "out.pdf"}},
    {"pdf_reflection", "conductor", 0, 1, {"out.pdf", NULL, NULL, NULL}},
    {"evaluate_reflection", "schlick", 0, 1, {"out.value", "out.pdf", NULL, NULL}},
    {"masking", "conductor", 0, 0, {"out.masking", "out.projected_area", NULL, NULL}},
    {"sample_transmission", "dielectric", 1, 0, {"out.outgoing.z", "out.weight", "out.eta_scale", NULL}},
    {"evaluate_transmission", "dielectric", 0, 1, {"out.value", NULL, NULL, NULL}},
    {"sample_scattering", "dielectric", 1, 0, {"out.outgoing.z", "out.weight", "out.branch_probability", NULL}},
    {"evaluate_scattering", "dielectric", 0, 1, {"out.value", "out.pdf", NULL, NULL}},
    {"albedo", "conductor", 0, 0, {"out.albedo", "out.mean_albedo", NULL, NULL}},
};

/* Runs a call on an engine into out[slot]; its counts. */
static fw_statistics run_call(fw_engine* engine, const struct call* call, int slot, const fw_table* table) {
  fw_statistics counts = {0, 0, 0, 0};
  fw_batch* batch = ordinary();
  EXPECT(fw_set_model(batch, "interface", call->interface) == FW_OK);
  EXPECT(fw_set_model(batch, "sampler", "visible") == FW_OK);
  if (table != NULL) EXPECT(fw_set_table(batch, table) == FW_OK);
  if (strcmp(call->interface, "dielectric") == 0) EXPECT(fw_set_value(batch, "eta", 1.5f) == FW_OK);
  if (strcmp(call->interface, "schlick") == 0) EXPECT(fw_set_value(batch, "f0", 0.04f) == FW_OK);
  if (call->samples) EXPECT(fw_set_generator(batch, 7, 0, NULL, 5) == FW_OK);
  if (call->queries) {
    EXPECT(fw_set_input(batch, "outgoing.x", ox, kLanes, 0) == FW_OK);
    EXPECT(fw_set_input(batch, "outgoing.y", oy, kLanes, 0) == FW_OK);
    EXPECT(fw_set_input(batch, "outgoing.z", oz, kLanes, 0) == FW_OK);
  }
  for (int k = 0; k < 4 && call->outputs[k] != NULL; ++k)
    EXPECT(fw_set_output(batch, call->outputs[k], out[slot][k], 0) == FW_OK);
  EXPECT(fw_set_byte_output(batch, "out.status", status[slot], 0) == FW_OK);
  EXPECT(fw_run(engine, call->operation, batch, &counts) == FW_OK);
  EXPECT(counts.accepted + counts.occluded + counts.smooth + counts.invalid == kLanes);
  fw_batch_destroy(batch);
  return counts;
}

static double gaussian(double x, double y, void* user) { return exp(-(x * x + y * y) / *(double*)user); }

static void errors(fw_engine* engine) {
  fw_batch* batch = ordinary();
  EXPECT_ERROR(fw_set_model(batch, "distribution", "wood"), FW_INVALID_ARGUMENT,
               "distribution: unknown value \"wood\"");
  EXPECT_ERROR(fw_set_model(batch, "colour", "red"), FW_INVALID_ARGUMENT, "colour: ");
  EXPECT_ERROR(fw_set_value(batch, "alpha", 1), FW_INVALID_ARGUMENT, "alpha: no input");
  EXPECT_ERROR(fw_set_output(batch, "pdf", out[0][0], 0), FW_INVALID_ARGUMENT, "pdf: no output");
  EXPECT_ERROR(fw_set_value(batch, NULL, 1), FW_INVALID_ARGUMENT, "field: ");
  out[0][0][0] = -7;
  EXPECT(fw_set_output(batch, "out.pdf", out[0][0], 0) == FW_OK);
  EXPECT_ERROR(fw_run(engine, "sample_reflection", batch, NULL), FW_INVALID_ARGUMENT, "u1: missing");
  EXPECT_ERROR(fw_run(engine, "polish", batch, NULL), FW_INVALID_ARGUMENT, "operation: unknown value \"polish\"");
  EXPECT(fw_set_generator(batch, 1, 0, NULL, 0) == FW_OK);
  EXPECT(fw_set_input(batch, "alpha_x", ix, 10, 0) == FW_OK);
  EXPECT_ERROR(fw_run(engine, "sample_reflection", batch, NULL), FW_INVALID_ARGUMENT,
               "alpha_x: 10 values for 1000 lanes");
  EXPECT(out[0][0][0] == -7);
  fw_batch_destroy(batch);
  EXPECT(fw_local("abacus") == NULL);
  EXPECT(strncmp(fw_error(), "target: ", 8) == 0);
  EXPECT(fw_table_load("/nowhere/table") == NULL);
  EXPECT(strstr(fw_error(), "/nowhere/table") != NULL);
}

static void fewer_lanes(fw_engine* engine) {
  /* Half the lanes by an active list are what they are in the whole; the others are left. */
  fw_batch* batch = ordinary();
  static uint32_t active[kLanes / 2];
  for (uint32_t k = 0; k < kLanes / 2; ++k) active[k] = 2 * k + 1;
  EXPECT(fw_set_generator(batch, 3, 0, NULL, 0) == FW_OK);
  EXPECT(fw_set_output(batch, "out.pdf", out[0][0], 0) == FW_OK);
  EXPECT(fw_run(engine, "sample_reflection", batch, NULL) == FW_OK);
  for (int k = 0; k < kLanes; ++k) out[1][0][k] = -1;
  EXPECT(fw_set_output(batch, "out.pdf", out[1][0], 0) == FW_OK);
  EXPECT(fw_set_active(batch, active, kLanes / 2) == FW_OK);
  fw_statistics counts;
  EXPECT(fw_run(engine, "sample_reflection", batch, &counts) == FW_OK);
  EXPECT(counts.accepted + counts.occluded + counts.smooth + counts.invalid == kLanes / 2);
  for (int k = 0; k < kLanes; ++k) EXPECT(out[1][0][k] == (k % 2 == 1 ? out[0][0][k] : -1));
  fw_batch_destroy(batch);
}

static void compaction(fw_engine* engine) {
  uint32_t index[kLanes];
  float kept[kLanes];
  const float* from[] = {ix};
  float* to[] = {kept};
  size_t accepted = 0, expected = 0;
  for (int k = 0; k < kLanes; ++k) status[0][k] = k % 3 == 0 ? 0 : 1;
  EXPECT(fw_compact(engine, kLanes, status[0], index, from, to, 1, &accepted) == FW_OK);
  for (uint32_t k = 0; k < kLanes; k += 3, ++expected) EXPECT(index[expected] == k && kept[expected] == ix[k]);
  EXPECT(accepted == expected);
}

int main(int argc, char** argv) {
  for (int k = 0; k < kLanes; ++k) {
    const double z = (k + 0.5) / kLanes, r = sqrt(1 - z * z), phi = 0.37 * k;
    ix[k] = (float)(r * cos(phi)), iy[k] = (float)(r * sin(phi)), iz[k] = (float)z;
    ox[k] = -iy[k], oy[k] = ix[k], oz[k] = k % 4 == 0 ? -iz[k] : iz[k];
  }
  double width = 0.8;
  fw_table* table = fw_table_build(gaussian, &width, 1);
  EXPECT(table != NULL);
  fw_engine* local = fw_local(NULL);
  EXPECT(local != NULL);
  errors(local);
  fewer_lanes(local);
  compaction(local);
  fw_engine* remote = argc > 1 ? fw_connect((const char* const*)&argv[1], 1, NULL) : fw_local("scalar");
  EXPECT(remote != NULL);
  if (local == NULL || remote == NULL || table == NULL) return 1;
  for (size_t c = 0; c < sizeof calls / sizeof *calls; ++c)
    for (int tabulated = 0; tabulated < 2; ++tabulated) {
      if (tabulated && strcmp(calls[c].operation, "albedo") == 0) continue; /* its table takes seconds */
      memset(out, 0, sizeof out);
      memset(status, 0, sizeof status);
      const fw_statistics a = run_call(local, &calls[c], 0, tabulated ? table : NULL);
      const fw_statistics b = run_call(remote, &calls[c], 1, tabulated ? table : NULL);
      EXPECT(memcmp(&a, &b, sizeof a) == 0);
      EXPECT(memcmp(out[0], out[1], sizeof out[0]) == 0);
      EXPECT(memcmp(status[0], status[1], sizeof status[0]) == 0);
      double sum = 0;
      for (int k = 0; k < kLanes; ++k) sum += fabsf(out[0][0][k]);
      EXPECT(sum > 1 && isfinite(sum));
    }
  fw_table_destroy(table);
  fw_engine_destroy(local);
  fw_engine_destroy(remote);
  if (failures == 0) printf("facetwise %s: the C interface is right\n", fw_version());
  return failures != 0;
}
