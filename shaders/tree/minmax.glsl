// SPDX-License-Identifier: MIT
// The minimum and the maximum of two; if the first is NaN, the second. Software GL has one instruction for these
// comparisons, and takes three for min() and max(), which `precise` keeps them from becoming: they are in the critical
// chain of a traversal step.
#ifdef SOFTWARE_GL
float lesser(float a, float b)
{
    precise float c = a < b ? a : b;
    return c;
}

float greater(float a, float b)
{
    precise float c = a > b ? a : b;
    return c;
}
#else
#define lesser min
#define greater max
#endif
