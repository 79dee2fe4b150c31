// SPDX-License-Identifier: MIT
// Cube of cells whose images are drawn: p_cell = (p_world - lower_world) / cell_world.

uniform vec3 lower_world;
uniform float cell_world;
