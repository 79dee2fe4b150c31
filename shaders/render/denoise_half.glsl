// SPDX-License-Identifier: MIT
// First half of a pixel's samples: the mean of the light divided by their own albedo, so that a difference of texture
// between the halves is no noise.
//
// Halves end where the number of samples is a power of two, as such runs are stratified (common/sequence.glsl). The mean
// of all samples is often much nearer to the truth than halves are to each other, so the difference of half of a half is
// kept too: both together show how fast the error falls (denoise_settle.comp).

// Number of samples in the first half: the power of two nearest to half of `count`.
uint first_half_of(uint count)
{
    uint doubled = 1u << findMSB(count);
    return max(2u * count < 3u * doubled ? doubled >> 1 : doubled, 1u);
}

vec3 divisor_of(vec3 albedo)
{
    return max(albedo, vec3(DENOISE_ALBEDO_MIN));
}

// rgb: the light, as floats. a: the difference from half of these samples, as colours with a common exponent.
uvec4 words_of_half(vec3 light, vec3 difference)
{
    float most = max(max(abs(difference.r), abs(difference.g)), abs(difference.b));
    int exponent = most > 0.0 ? clamp(int(floor(log2(most))) + 1, -126, 127) : -126;
    vec3 parts = clamp(difference * exp2(float(-exponent)), vec3(-1.0), vec3(1.0));
    return uvec4(floatBitsToUint(light), packSnorm4x8(vec4(parts, 0.0)) | uint(exponent + 127) << 24);
}

vec3 light_of_half(uvec4 words)
{
    return uintBitsToFloat(words.rgb);
}

vec3 difference_of_half(uvec4 words)
{
    return unpackSnorm4x8(words.a).rgb * exp2(float(int(words.a >> 24)) - 127.0);
}
