// SPDX-License-Identifier: MIT
// 3x4 transforms.

// Transforms by the rows of a 3x4 matrix: a point, a vector; and a covector, by the transposed upper 3x3: with the rows
// of object_from_world this takes an object-space normal to world space, also where the scale is uneven. `precise` makes
// all programs find the same place: one draws or shades what another one counts or hits there.
vec3 affine_point(vec4 rows[3], vec3 point)
{
    vec4 p = vec4(point, 1.0);
    precise vec3 moved = vec3(dot(rows[0], p), dot(rows[1], p), dot(rows[2], p));
    return moved;
}

vec3 affine_vector(vec4 rows[3], vec3 vector)
{
    precise vec3 turned = vec3(dot(rows[0].xyz, vector), dot(rows[1].xyz, vector), dot(rows[2].xyz, vector));
    return turned;
}

vec3 affine_covector(vec4 rows[3], vec3 covector)
{
    precise vec3 turned = rows[0].xyz * covector.x + rows[1].xyz * covector.y + rows[2].xyz * covector.z;
    return turned;
}
