// SPDX-License-Identifier: Apache-2.0
#include "facetwise/tune_malloc.h"

#include <cstdlib>  // defines __GLIBC__ where the C library is glibc

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace facetwise {

void tune_malloc() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the largest that glibc takes on 64-bit machines
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
#endif
}

}  // namespace facetwise
