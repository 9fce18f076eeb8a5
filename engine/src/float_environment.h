// SPDX-License-Identifier: Apache-2.0
// The floating-point control register, set to IEEE defaults for as long as an object of this lives: callers
// built on Embree run with denormals flushed, some round otherwise, and neither may change a result.
#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace facetwise {

class FloatEnvironment {
 public:
#if defined(__x86_64__)
  FloatEnvironment() : saved_(_mm_getcsr()) {
    constexpr unsigned kFlags = 0x3F, kIeee = 0x1F80;  // nearest, no FTZ or DAZ, exceptions masked
    if ((saved_ & ~kFlags) != kIeee) _mm_setcsr(kIeee);
  }
  ~FloatEnvironment() { _mm_setcsr(saved_); }
#elif defined(__aarch64__)
  FloatEnvironment() {
    asm volatile("mrs %0, fpcr" : "=r"(saved_));
    asm volatile("msr fpcr, %0" : : "r"(std::uint64_t{0}) : "memory");
  }
  ~FloatEnvironment() { asm volatile("msr fpcr, %0" : : "r"(saved_) : "memory"); }
#else
#error "facetwise: the floating-point control register of this architecture is not known"
#endif
  FloatEnvironment(const FloatEnvironment&) = delete;
  FloatEnvironment& operator=(const FloatEnvironment&) = delete;

 private:
#if defined(__x86_64__)
  unsigned saved_;
#else
  std::uint64_t saved_;
#endif
};

}  // namespace facetwise
