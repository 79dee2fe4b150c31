// SPDX-License-Identifier: MIT
// Samples a direction of the environment in proportion to its radiance: per cell of a table over the directions, rows
// from +y down, made by server/render/light/environment_choice.c. An environment of one colour is equally bright everywhere,
// and sampled by the cosine.
//
// The table: rows + 1 sums up to each row, then for each row columns + 1 sums up to each column, as shares of the total.
//
// Defines: HAS_ENVIRONMENT_TABLE there is a table; those of common/environment.glsl.

#include "common/environment.glsl"

#ifdef HAS_ENVIRONMENT_TABLE
layout(binding = UNIT_SHADE_ENVIRONMENT) uniform samplerBuffer environment_table;
uniform uint environment_rows, environment_columns;

// Finds the last of `count` cells whose sum begins at or below u, and the position of u in it, 0..1.
uint environment_cell(uint first, uint count, float u, out float rest, out float share)
{
    uint low = 0u, high = count;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        bool beyond = texelFetch(environment_table, int(first + middle)).r <= u;
        low = beyond ? middle : low;
        high = beyond ? high : middle;
    }
    float from = texelFetch(environment_table, int(first + low)).r;
    share = texelFetch(environment_table, int(first + low + 1u)).r - from;
    rest = share > 0.0 ? clamp((u - from) / share, 0.0, 1.0) : 0.5;
    return low;
}

uint environment_row_first(uint row)
{
    return environment_rows + 1u + row * (environment_columns + 1u);
}

float environment_solid_angle(uint row)
{
    float step_ = PI / float(environment_rows);
    return TWO_PI / float(environment_columns) * (cos(float(row) * step_) - cos(float(row + 1u) * step_));
}
#endif

// Chooses a direction. `probability`: per steradian; 0: there is none.
vec3 environment_choose(vec3 normal, vec2 u, out float probability)
{
#ifdef HAS_ENVIRONMENT_TABLE
    float up_share, across_share;
    vec2 place;
    uint row = environment_cell(0u, environment_rows, u.y, place.y, up_share);
    uint column = environment_cell(environment_row_first(row), environment_columns, u.x, place.x, across_share);
    probability = up_share * across_share / environment_solid_angle(row);
    float step_ = PI / float(environment_rows);
    float y = mix(cos(float(row) * step_), cos(float(row + 1u) * step_), place.y);
    float phi = ((float(column) + place.x) / float(environment_columns) - 0.5) * TWO_PI;
    float sine = sqrt(max(1.0 - y * y, 0.0));
    return environment_turned_back(vec3(sine * sin(phi), y, -sine * cos(phi)));
#else
    vec3 x, y;
    tangent_frame(normal, x, y);
    float sine = sqrt(u.x), phi = TWO_PI * u.y, cosine = sqrt(1.0 - u.x);
    probability = cosine * INVERSE_PI;
    return sine * (cos(phi) * x + sin(phi) * y) + cosine * normal;
#endif
}

// Probability density of a direction that another technique sampled.
float environment_probability(vec3 normal, vec3 direction)
{
#ifdef HAS_ENVIRONMENT_TABLE
    vec2 place = environment_place(direction);
    uint row = min(uint(place.y * float(environment_rows)), environment_rows - 1u);
    uint column = min(uint(place.x * float(environment_columns)), environment_columns - 1u), first = environment_row_first(row);
    float up_share = texelFetch(environment_table, int(row + 1u)).r - texelFetch(environment_table, int(row)).r;
    float across_share =
        texelFetch(environment_table, int(first + column + 1u)).r - texelFetch(environment_table, int(first + column)).r;
    return up_share * across_share / environment_solid_angle(row);
#else
    return max(dot(normal, direction), 0.0) * INVERSE_PI;
#endif
}
