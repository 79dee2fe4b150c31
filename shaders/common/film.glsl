// SPDX-License-Identifier: MIT
// Reflectance of a surface under a thin film, whose two sides interfere: Belcour, Barla. A Practical Extension to
// Microfacet Theory for the Modeling of Varying Iridescence. 2017, in the form of KHR_materials_iridescence (appendix B.3
// of its implementation notes): Schlick's curve at the lower side, no polarisation, and up to two round trips of the
// light. The upper side obeys Fresnel's equations, as Schlick's curve is not 0 where both indices are equal.
//
// Defines: HAS_IRIDESCENCE some material has a thin film.

#include "common/brdf.glsl"
#include "common/material.glsl"

#ifdef HAS_IRIDESCENCE
// Thickness, nanometres, below which a film fades out.
const float FILM_THIN_NM = 0.03;
// Maximum reflectance for which an index is computed.
const float FILM_F0_MAX = 0.9999;

// Spectrum of interference as the eye perceives it, in Rec. 709: section 4.1, Gaussians fitted to CIE 1931 in the Fourier
// domain. `difference_nm`: of the two optical paths; `shift`: of their phases.
vec3 film_sensitivity(float difference_nm, vec3 shift)
{
    const vec3 HEIGHT = vec3(5.4856e-13, 4.4201e-13, 5.2481e-13), PLACE = vec3(1.6810e+06, 1.7953e+06, 2.2084e+06),
               VARIANCE = vec3(4.3278e+09, 9.3046e+09, 6.6121e+09);
    const float HEIGHT_2 = 9.7470e-14, PLACE_2 = 2.2399e+06, VARIANCE_2 = 4.5282e+09, WHITE = 1.0685e-7;
    const mat3 REC709_FROM_XYZ = mat3(3.2404542, -0.9692660, 0.0556434, -1.5371385, 1.8760108, -0.2040259, -0.4985314,
                                      0.0415560, 1.0572252);
    float phase = TWO_PI * difference_nm * 1e-9;
    vec3 xyz = HEIGHT * sqrt(TWO_PI * VARIANCE) * cos(PLACE * phase + shift) * exp(-square(phase) * VARIANCE);
    xyz.x += HEIGHT_2 * sqrt(TWO_PI * VARIANCE_2) * cos(PLACE_2 * phase + shift.x) * exp(-VARIANCE_2 * square(phase));
    return REC709_FROM_XYZ * (xyz / WHITE);
}

vec3 film_schlick(vec3 f0, float cosine)
{
    float m = clamp(1.0 - cosine, 0.0, 1.0), m2 = m * m;
    return f0 + (1.0 - f0) * (m2 * m2 * m);
}

// Reflectance of a film over a surface that mirrors `f0` in air.
vec3 film_reflectance(float cosine, float ior, float thickness_nm, vec3 f0)
{
    ior = mix(1.0, ior, smoothstep(0.0, FILM_THIN_NM, thickness_nm));
    float within = sqrt(max(1.0 - (1.0 - square(cosine)) / square(ior), 0.0)); // cosine within the film
    float first = fresnel_dielectric(cosine, ior), passes = 1.0 - first;
    vec3 root = sqrt(clamp(f0, 0.0, FILM_F0_MAX)), base_ior = (1.0 + root) / (1.0 - root);
    vec3 step_ = (base_ior - ior) / (base_ior + ior), second = film_schlick(step_ * step_, within);
    vec3 shift = PI + mix(vec3(0.0), vec3(PI), lessThan(base_ior, vec3(ior)));
    vec3 both = clamp(first * second, 1e-5, FILM_F0_MAX), rest = passes * passes * second / (1.0 - both);
    vec3 sum = first + rest, order = rest - passes;
    float difference_nm = 2.0 * ior * thickness_nm * within;
    for (int m = 1; m <= 2; m++) {
        order *= sqrt(both);
        sum += order * 2.0 * film_sensitivity(float(m) * difference_nm, float(m) * shift);
    }
    return clamp(sum, 0.0, 1.0); // clamps colours beyond Rec. 709
}

// Reflectance of a surface with a film, dielectric or metal.
vec3 film_of(surface s, float cosine)
{
    vec3 dielectric = vec3(square((s.ior - 1.0) / (s.ior + 1.0)));
#ifdef HAS_SPECULAR
    dielectric = min(dielectric * s.specular_colour, 1.0) * s.specular;
#endif
    return film_reflectance(cosine, s.film_ior, s.film_nm, mix(dielectric, s.base, s.metallic));
}

// Mean of film_of() over facets, represented by three: Gauss' quadrature over the shares of those with a smaller angle. A
// film's curve bends too often for a single one: that made up to 1.14 of the light, or left 0.93.
vec3 film_of_three(surface s, vec3 cosines)
{
    return (5.0 * film_of(s, cosines.x) + 8.0 * film_of(s, cosines.y) + 5.0 * film_of(s, cosines.z)) / 18.0;
}

// Reflectance of the facets that are seen and lit. The distances between the three, and of the middle one from the view's
// cosine, are polynomials fitted to integrals over GGX facets (common/facets.glsl) under 45 films of 80 to 1200 nm and of
// indices up to 2.2. The reflectance is off by -0.008 to 0.010 for cosines above 0.1, so white plastic with a film keeps
// 0.983 to 1.009 of the light at an angle, and 0.996 to 0.999 over all angles.
vec3 facets_film(surface s, float cosine, float alpha)
{
    float r = sqrt(alpha), x = cosine / (cosine + alpha);
    vec3 upright = vec3(6.9941, 4.0957, 4.6104) + vec3(-7.2656, -6.0953, -3.7189) * r +
                   vec3(-2.3803, -1.2283, -2.5737) * x;
    vec3 slanted = vec3(-5.5089, -3.5344, -4.5953) + vec3(9.7564, 6.4335, 7.8955) * r +
                   vec3(-4.0762, -3.1236, -3.4362) * alpha + upright * x;
    vec3 away = r * (vec3(1.0069, 0.6213, 2.6883) + vec3(-0.7436, 0.6637, -4.5809) * r +
                     vec3(0.0690, -0.6492, 2.1640) * alpha + slanted * x);
    vec3 cosines = vec3(cosine + away.y) + vec3(-max(away.x, 0.0), 0.0, max(away.z, 0.0));
    return film_of_three(s, clamp(cosines, 1e-4, 1.0));
}

// Mean of facets_film() over the hemisphere, cosine-weighted; fitted.
vec3 facets_film_mean(surface s, float alpha)
{
    float r = sqrt(alpha);
    return film_of_three(s, vec3(0.3098, 0.6917, 0.9632) + r * (vec3(-0.0721, -0.1360, -0.0755) +
                            r * (vec3(0.8626, 0.6746, 0.2208) + r * vec3(-0.5485, -0.3734, -0.1268))));
}
#endif
