/* facetwise in C: every operation, model and table, here or on servers, as the C++ library has them. The fields of a batch and
 * the values of a model are named as there (facetwise/batch.h and facetwise/model.h say what they mean, their shapes, units and
 * ranges), so that what the library learns is here at once.
 *
 * Calls that can fail return a fw_status, or a null handle; fw_error() then has the text, which names the field. Handles may be
 * used by one thread at a time; engines and tables by any number. No call keeps a caller's memory but a batch, until its next
 * fw_set_... of that field. SPDX-License-Identifier: Apache-2.0 */
#ifndef FACETWISE_H_
#define FACETWISE_H_

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum fw_status {
  FW_OK = 0,
  FW_CANCELLED = 1,
  FW_INVALID_ARGUMENT = 3, /* nothing was written */
  FW_DEADLINE_EXCEEDED = 4,
  FW_NOT_FOUND = 5,
  FW_PERMISSION_DENIED = 7,
  FW_RESOURCE_EXHAUSTED = 8,
  FW_FAILED_PRECONDITION = 9,
  FW_INTERNAL = 13,
  FW_UNAVAILABLE = 14,
  FW_UNAUTHENTICATED = 16
} fw_status;

typedef struct fw_batch fw_batch;
typedef struct fw_engine fw_engine;
typedef struct fw_table fw_table;

/* "major.minor.patch". */
const char* fw_version(void);
/* Of this thread's last call that failed; valid until its next. */
const char* fw_error(void);

/* A batch of `lanes` lanes without columns: smith-ggx, a conductor, the sampler exact. */
fw_batch* fw_batch_create(size_t lanes);
void fw_batch_destroy(fw_batch* batch);
/* Columns stay as they are: set those whose length changes. */
fw_status fw_set_lanes(fw_batch* batch, size_t lanes);

/* What: "distribution", "masking", "shadowing", "normalisation", "interface", "transport", "compensation", "retro" ("true" or
 * "false"), "sampler". Values: the names in model.h, as "beckmann". Of a tabulated distribution set the table instead. */
fw_status fw_set_model(fw_batch* batch, const char* what, const char* value);
fw_status fw_set_table(fw_batch* batch, const fw_table* table);

/* A column by its name in batch.h: "incident.x", "alpha_x", "u1", "out.pdf", "out.status" ... Strides are in bytes, 0 for values
 * without gaps. An input has `count` values, one for each lane or one for all; values == NULL takes the column away. */
fw_status fw_set_input(fw_batch* batch, const char* field, const float* values, size_t count, size_t stride);
/* One value, copied, for all lanes. */
fw_status fw_set_value(fw_batch* batch, const char* field, float value);
/* One value for each lane. */
fw_status fw_set_output(fw_batch* batch, const char* field, float* values, size_t stride);
fw_status fw_set_byte_output(fw_batch* batch, const char* field, uint8_t* values, size_t stride);
/* Only these lanes, in any order; NULL: all. */
fw_status fw_set_active(fw_batch* batch, const uint32_t* lanes, size_t count);
/* Random numbers in the kernels instead of u1, u2, u3: Philox by seed, dimension and the lane's id, which is its value in `ids`
 * (one for each lane), or first_id and its index where ids is NULL. */
fw_status fw_set_generator(fw_batch* batch, uint64_t seed, uint32_t dimension, const uint64_t* ids, uint64_t first_id);
fw_status fw_clear_generator(fw_batch* batch);

/* This machine's engine. target: "best", "scalar", "avx2", "avx3" or "neon"; NULL: best. */
fw_engine* fw_local(const char* target);
/* Servers', each "unix:PATH" or "HOST:PORT": lanes are spread over those that are there, and one is enough. The options may be
   NULL, and so may each of them. */
typedef struct fw_connection {
  const char *tls_ca, *tls_certificate, *tls_key, *tls_name; /* PEM files; the name in the server's certificate */
  const char* token_file;
  int compact_answers; /* not 0: directions and weights in half their bytes, for networks (facetwise/client.h) */
} fw_connection;
fw_engine* fw_connect(const char* const* addresses, size_t count, const fw_connection* options);
void fw_engine_destroy(fw_engine* engine);

/* What became of the lanes. */
typedef struct fw_statistics {
  uint64_t accepted, occluded, smooth, invalid;
} fw_statistics;
/* operation: "sample_reflection", "evaluate_reflection", ... statistics may be NULL. */
fw_status fw_run(fw_engine* engine, const char* operation, const fw_batch* batch, fw_statistics* statistics);

/* The accepted of `lanes` lanes, in order: `index` gets their indices (NULL: not wanted), and to[c] what from[c] has of them, for
 * `columns` columns without gaps. Each has room for `lanes` values. *accepted: how many. */
fw_status fw_compact(fw_engine* engine, size_t lanes, const uint8_t* status, uint32_t* index, const float* const* from,
                     float* const* to, size_t columns, size_t* accepted);

/* Tables of slopes: built from a density P22(x, y) >= 0 of any scale (radial: one that depends on x^2 + y^2), or read. */
typedef double (*fw_density)(double x, double y, void* user);
fw_table* fw_table_build(fw_density density, void* user, int radial);
fw_table* fw_table_load(const char* path);
fw_status fw_table_save(const fw_table* table, const char* path);
void fw_table_destroy(fw_table* table);

/* Tables of albedo, which a local engine builds when a batch's model first needs one (seconds). Keeps the model's in a file:
 * reads it from there if there is one, else builds and writes it. */
fw_status fw_keep_albedo_table(const fw_batch* batch, const char* path);

#ifdef __cplusplus
}
#endif

#endif
