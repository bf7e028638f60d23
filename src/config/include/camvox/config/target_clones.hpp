#pragma once

/// Before a function with a hot loop: compiles it for the baseline processor, for x86-64-v3 (AVX2)
/// and for x86-64-v4 (twice the registers), and picks at load time. The loop must be plain enough
/// for the compiler to vectorise; helpers must be `CAMVOX_ALWAYS_INLINE`, since neither lambdas nor
/// ordinary functions inherit the target. Empty where the attribute is not available. Use it for
/// integer code, whose results do not depend on the clone; floating point may contract to fused
/// operations.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define CAMVOX_TARGET_CLONES \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define CAMVOX_TARGET_CLONES
#endif

/// A helper that becomes part of every clone that calls it.
#if defined(__GNUC__)
#define CAMVOX_ALWAYS_INLINE inline __attribute__((always_inline))
#else
#define CAMVOX_ALWAYS_INLINE inline
#endif
