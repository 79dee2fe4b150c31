// SPDX-License-Identifier: MIT
// Intersections of rays with triangles, spheres and discs. Directions need not be unit: distances are in their lengths.

// Intersects a triangle, whose vertices are relative to the ray's origin. Gives the distance and the barycentrics of the
// second and third vertex; both sides count. The edge functions are those of Pluecker coordinates, each computed from the
// edge's difference and sum, so that two triangles that share an edge get exactly opposite values for it and no ray
// passes between them; `precise` keeps the compiler from fusing the products differently on each side, and gives all
// programs the same answer. Woop, Benthin, Wald, Watertight Ray/Triangle Intersection, JCGT 2013; the form is that of
// Embree's robust mode.
bool intersect_triangle(vec3 direction, vec3 v0, vec3 v1, vec3 v2, out float distance, out vec2 barycentrics)
{
    precise float w0 = dot(cross(v2 - v1, v2 + v1), direction);
    precise float w1 = dot(cross(v0 - v2, v0 + v2), direction);
    precise float w2 = dot(cross(v1 - v0, v1 + v0), direction);
    distance = 0.0;
    barycentrics = vec2(0.0);
    if (min(w0, min(w1, w2)) < 0.0 && max(w0, max(w1, w2)) > 0.0)
        return false;
    precise float sum = w0 + w1 + w2;
    precise vec3 normal = cross(v1 - v0, v2 - v0);
    precise float slope = dot(normal, direction), along = dot(normal, v0) / slope;
    if (sum == 0.0 || slope == 0.0) // seen on edge, or no area
        return false;
    distance = along;
    barycentrics = vec2(w1, w2) / sum;
    return true;
}

// The intersections of the ray's line with a sphere. The discriminant is computed from the distance of the closest
// point, which stays precise where the sphere is small or far, and the roots by the form without cancellation. Haines,
// Guenther, Akenine-Moeller, Precision Improvements for Ray/Sphere Intersection, Ray Tracing Gems, ch. 7.
bool intersect_sphere(vec3 origin, vec3 direction, vec3 centre, float radius, out vec2 distances)
{
    vec3 f = origin - centre;
    float a = dot(direction, direction);
    float b = -dot(f, direction);
    vec3 closest = f + (b / a) * direction;
    float discriminant = radius * radius - dot(closest, closest);
    distances = vec2(0.0);
    if (!(discriminant >= 0.0)) // not >=: a direction of length zero misses too
        return false;
    float from_centre = length(f);
    float c = (from_centre - radius) * (from_centre + radius);
    float q = b + (b >= 0.0 ? 1.0 : -1.0) * sqrt(a * discriminant);
    float t0 = q == 0.0 ? 0.0 : c / q;
    float t1 = q / a;
    distances = vec2(min(t0, t1), max(t0, t1));
    return true;
}

bool intersect_disc(vec3 origin, vec3 direction, vec3 centre, vec3 normal, float radius, out float distance)
{
    float slope = dot(direction, normal);
    distance = 0.0;
    if (slope == 0.0)
        return false;
    distance = dot(centre - origin, normal) / slope;
    vec3 from_centre = origin + distance * direction - centre;
    return dot(from_centre, from_centre) <= radius * radius;
}
