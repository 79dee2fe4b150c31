// SPDX-License-Identifier: MIT
// Adds the transmittances of the rays of layers_ao.comp to the layer's samples, in the order of a sample's rays.

#include "shared/layers.h"
#include "common/dispatch.glsl"
#include "common/visibility.glsl"
#include "render/wave.glsl"

layout(local_size_x = 64) in;

uniform uint ray_count; // rays of the slice
uniform uint batch_rays, all_rays;
uniform uint plane; // plane of the layer

layout(std430, binding = BIND_HIT_LIST) readonly buffer list_block { uint hit_list[]; };
layout(std430, binding = BIND_VISIBILITY) readonly buffer visibility_block { uint visibility[]; };
layout(std430, binding = BIND_LAYER_SUMS) buffer layer_block { vec4 layer_sums[]; };

void main()
{
    uint j = item_index();
    if (j >= wave.hits.count)
        return;
    uint place = plane * ray_count + hit_list[j];
    float open_share = layer_sums[place].r; // sums ray by ray, so that the result does not depend on the batches
    for (uint i = 0u; i < batch_rays; i++) { // mean of a coloured transmittance
        vec3 through = transmittance_of(visibility[i * wave.hits.count + j]);
        open_share += dot(through, vec3(1.0 / 3.0)) / float(all_rays);
    }
    layer_sums[place].rgb = vec3(open_share);
}
