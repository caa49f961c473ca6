/* What the processor can do, asked of the processor itself; needs no library of the compiler. */
#pragma once
#if defined(__x86_64__)
#include <cpuid.h>
/* The highest level of x86-64 that it has all of, and whose registers the system saves: 1, 3 (AVX2, BMI1, BMI2, F16C, FMA, LZCNT,
   MOVBE) or 4 (AVX-512 F, DQ, CD, BW, VL); 0 for other processors. */
static int x86_64_level(void) {
    unsigned a, b, c, d, low, high;
    const unsigned leaf1 = 1u << 12 | 1u << 22 | 1u << 27 | 1u << 28 | 1u << 29; /* FMA MOVBE OSXSAVE AVX F16C */
    const unsigned leaf7 = 1u << 3 | 1u << 5 | 1u << 8;                          /* BMI1 AVX2 BMI2 */
    const unsigned wide = 1u << 16 | 1u << 17 | 1u << 28 | 1u << 30 | 1u << 31;  /* AVX512F DQ CD BW VL */
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & leaf1) != leaf1)
        return 1;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    if ((low & 6) != 6)
        return 1;
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || (b & leaf7) != leaf7)
        return 1;
    const int is_wide = (b & wide) == wide && (low & 0xe6) == 0xe6;
    if (!__get_cpuid(0x80000001, &a, &b, &c, &d) || !(c & 1u << 5)) /* LZCNT */
        return 1;
    return is_wide ? 4 : 3;
}
#else
static int x86_64_level(void) { return 0; }
#endif

#define PROCESSOR_TEXT_(x) #x
#define PROCESSOR_TEXT(x) PROCESSOR_TEXT_(x)
static const char *compiler_name(void) {
#if defined(__clang__)
    return "Clang " PROCESSOR_TEXT(__clang_major__) "." PROCESSOR_TEXT(__clang_minor__) "." PROCESSOR_TEXT(__clang_patchlevel__);
#else
    return "GCC " __VERSION__;
#endif
}
