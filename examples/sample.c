/* SPDX-License-Identifier: Apache-2.0 */
/* A lobe in C: a million reflections of one direction, sampled here or, with an address, by a server.
 * cc sample.c -lfacetwise -lm && ./a.out [unix:PATH|HOST:PORT] */
#include <facetwise.h>
#include <stdio.h>
#include <stdlib.h>

static void check(fw_status status) {
  if (status == FW_OK) return;
  fprintf(stderr, "%s\n", fw_error());
  exit(1);
}

int main(int argc, char** argv) {
  const size_t lanes = 1000000;
  fw_engine* engine = argc > 1 ? fw_connect((const char* const*)&argv[1], 1, NULL) : fw_local(NULL);
  if (engine == NULL) {
    fprintf(stderr, "%s\n", fw_error());
    return 1;
  }
  float* z = malloc(lanes * sizeof(float));
  float* weight = malloc(lanes * sizeof(float));
  fw_batch* batch = fw_batch_create(lanes);
  check(fw_set_value(batch, "incident.x", 0.6f));
  check(fw_set_value(batch, "incident.y", 0));
  check(fw_set_value(batch, "incident.z", 0.8f));
  check(fw_set_value(batch, "alpha_x", 0.5f));
  check(fw_set_value(batch, "alpha_y", 0.2f));
  check(fw_set_generator(batch, 1, 0, NULL, 0));
  check(fw_set_output(batch, "out.outgoing.z", z, 0));
  check(fw_set_output(batch, "out.weight", weight, 0));
  fw_statistics counts;
  check(fw_run(engine, "sample_reflection", batch, &counts));
  double albedo = 0, height = 0;
  for (size_t k = 0; k < lanes; ++k) {
    albedo += weight[k];
    height += z[k];
  }
  printf("facetwise %s: albedo %.4f, mean o_z %.4f, %llu of %zu occluded\n", fw_version(), albedo / (double)lanes,
         height / (double)lanes, (unsigned long long)counts.occluded, lanes);
  fw_batch_destroy(batch);
  fw_engine_destroy(engine);
  free(z);
  free(weight);
  return 0;
}
