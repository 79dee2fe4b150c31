/* SPDX-License-Identifier: MIT */
/* Copy of a scene on the device, by revision; shared by all tracers and integrators. */
#ifndef FARLIGHT_GPU_SCENE_SCENE_H
#define FARLIGHT_GPU_SCENE_SCENE_H

#include "base/error.h"
#include "base/stage_times.h"
#include "gpu/buffer.h"
#include "gpu/device.h"
#include "gpu/texture.h"
#include "scene/pose.h"
#include "scene/scene.h"
#include "shared/geometry.h"
#include "shared/tables.h"

#include <stdbool.h>
#include <stdint.h>

/* Kinds of change between two frames, as bits. By the same bits a tracer names the inputs of its structure
 * (tracer_impl.depends_on). */
enum scene_change {
    CHANGED_GEOMETRY = 1 << 0, /* meshes or sphere sets were added, removed or set again */
    CHANGED_DEFORMED =
        1 << 1, /* vertices of deforming geometries moved; which: gpu_scene_geometry.deformed_revision */
    CHANGED_INSTANCES = 1 << 2, /* transforms, or the set of instances */
    CHANGED_DISCS = 1 << 3,     /* discs, which only the reference's structure holds */
    CHANGED_SHADING = 1 << 4,   /* materials, textures; alpha too */
    CHANGED_SURFACES = 1 << 5,  /* among these: textures, their use in materials, and cutouts; not factors */
    CHANGED_LIGHTS = 1 << 6,    /* lights and the environment */
    CHANGED_VIEW = 1 << 7,      /* the camera, or the size of the picture: struct trace_view. Never changed by a
                                   scene */
};
#define CHANGED_SCENE (CHANGED_VIEW - 1u) /* every bit that a scene can change */
/* Bits for a structure that is built for the first time. */
#define CHANGED_ALL (CHANGED_SCENE | (unsigned)CHANGED_VIEW)

/* Changes by an update of the copy. */
struct scene_changes {
    unsigned bits; /* enum scene_change */
    uint64_t uploaded_bytes;
};

/* Consecutive primitives of a geometry in object space, and at rest where they deform. */
#define GEOMETRY_RUN 256u
struct geometry_run {
    float centre[3], radius; /* a ball round them */
    float area;              /* sum of theirs */
};

/* Mirror, on the host, of the arrays that builders need, in device order. */
struct gpu_scene_geometry {
    struct geometry device;
    const struct scene_mesh *mesh; /* exactly one of these two is set; valid until the scene is edited */
    const struct scene_spheres *spheres;
    uint64_t revision; /* the object's revision: unchanged means the same primitives, and the same shape where
                          node is 0 */
    uint32_t id;       /* the object's id; unique together with `node` and the choice of the two */
    /* The only node that shows this geometry, and deforms the mesh; 0: the mesh undeformed, or a set of
     * spheres. With a skin its vertices are in world space, and its instance's transform is the identity. */
    uint32_t node;
    uint64_t deformed_revision; /* counts changes of its vertices, or of those at shutter close; 0: they are
                                   those of the mesh */
    float lower[3], upper[3];   /* bounds in object space while the shutter is open; conservative for a
                                   deforming mesh: from its joints and weights, up to rounding */
    struct geometry_run *runs;  /* owned; the last one may have fewer primitives */
};

struct gpu_scene {
    struct gpu_device *device;
    const struct scene *scene; /* the scene of the last update, for tracers on the host; valid until it
                                  is edited */
    /* The motion of the last update; NULL: all objects as committed. The caller's: valid as long as the caller
     * keeps it, which is until the tracers are updated. */
    const struct scene_motion *motion;
    uint64_t revision; /* revision of the scene on the device */
    struct gpu_scene_geometry *geometries;
    uint32_t geometry_count;
    struct instance *instances; /* mirror of the buffer */
    uint32_t instance_count;
    float (*motions)[12];  /* mirror of the buffer: matrices of instance i begin at (instances[i].motion - 1) /
                              3 */
    uint32_t motion_count; /* number of matrices */
    struct disc *discs;
    uint32_t disc_count;
    uint32_t material_count, light_count;
    bool has_spheres;     /* some geometry is a set of spheres */
    bool has_cutout;      /* some material in use is alpha mode mask: tracers must evaluate alpha */
    bool has_translucent; /* some material lets shadow rays pass: blend or transmission */
    bool has_transmission;
    bool has_varied_alpha;     /* the transmittance of one of these varies over its surface: texture or vertex
                                  colours */
    bool has_texcoords;        /* some mesh has texture coordinates */
    bool has_colours;          /* some mesh has vertex colours */
    bool has_tangents;         /* some mesh has tangents, or some material in use needs those of its texture
                                  coordinates: normal or bump map, anisotropy */
    bool has_motion;           /* something moves while the shutter is open: tracers must use the rays' times */
    bool has_emitters;         /* some emissive triangle is in the tables of shared/emitter.h */
    bool has_lamps;            /* some of these is brighter than 1, the maximum reflection of light of 1 */
    bool has_emissive_spheres; /* some material of spheres would make triangles emitters */
    bool has_environment_image;
    float lower_world[3], upper_world[3]; /* bounds of all instances and of lights with a place; without discs */
    float diagonal;                       /* diagonal of these bounds */
    /* Buffers, described in shared/geometry.h, shared/tables.h and shared/material.h. */
    struct gpu_buffer triangles, positions, normals, tangents, texcoords, colours, spheres, sphere_materials;
    struct gpu_buffer instance_buffer, motion_buffer, tables, texels, lights;
    struct table_starts table_starts; /* mirror of the head of `tables` */
    struct gpu_texture environment;
    float environment_colour[3], environment_rotation;
    /* Revisions present on the device. */
    uint64_t geometry_revision, instances_revision, shading_revision, lights_revision;
    uint64_t deformed_revision;    /* last number given out; continues when the copy is rebuilt, as tracers
                                      identify kept data by it */
    struct gpu_scene_state *state; /* private to gpu_scene/: mirrors that show which parts need no upload */
};

void gpu_scene_init(struct gpu_scene *gpu, struct gpu_device *device);
void gpu_scene_finish(struct gpu_scene *gpu);
/* Brings the copy to the scene's revision and to the poses while the shutter is open (NULL: as committed);
 * *changes lists the changes. Materials, lights and their transforms, and hidden nodes are those of the first
 * pose. Instances whose transform is singular in some pose are left out. On failure the copy is empty, and the
 * next update rebuilds it. */
bool gpu_scene_update(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                      struct scene_changes *changes, struct stage_times *times, struct error *error);
/* Updates `has_emitters`, `has_lamps` and their tables after gpu_scene_update(), for integrators that sample
 * emissive triangles. With many of them the tree takes a while, which other integrators save. Fails like
 * gpu_scene_update(). */
bool gpu_scene_update_emitters(struct gpu_scene *gpu, struct scene_changes *changes, struct stage_times *times,
                               struct error *error);
/* Whether gpu_scene_update_emitters() would change nothing. */
bool gpu_scene_emitters_are_current(const struct gpu_scene *gpu);
/* Uploads the large parts of the scene (triangles, vertices, textures) until about `end_ns` of the clock.
 * *done: all are there, and the update will not take long for them. An update without it uploads everything at
 * once. Between two steps the scene must not change, and nobody may use the copy. Fails like
 * gpu_scene_update(); ERROR_BUSY: memory is reserved in steps, and the next step continues. */
bool gpu_scene_bring(struct gpu_scene *gpu, const struct scene *scene, uint64_t end_ns, bool *done,
                     struct stage_times *times, struct error *error);
/* Whether the next step would only wait. */
bool gpu_scene_bring_waits(struct gpu_scene *gpu);
/* Drops an unfinished upload: the copy is then empty. */
void gpu_scene_bring_abandon(struct gpu_scene *gpu);
/* Whether an update would change nothing. */
bool gpu_scene_is_current(const struct gpu_scene *gpu, const struct scene *scene,
                          const struct scene_motion *motion);
/* Transforms of an instance in the poses, one if it stands still: world_from_object, borrowed from the copy. */
const float (*gpu_scene_poses(const struct gpu_scene *gpu, const struct instance *instance,
                              uint32_t *pose_count))[12];
/* Bounds of an instance in world space, for the whole time that the shutter is open. */
void gpu_scene_instance_bounds(const struct gpu_scene *gpu, uint32_t instance, float lower_world[3],
                               float upper_world[3]);
/* Binds every buffer and texture at its place in shared/bindings.h. */
void gpu_scene_bind(struct gpu_scene *gpu);
/* Uploads the environment's image after an update, until about `end_ns`, in as many calls as it takes. No frame
 * may show it before it is `done`. Fails like gpu_texture_reserve(), also where that is postponed. */
bool gpu_scene_upload_environment(struct gpu_scene *gpu, uint64_t end_ns, bool *done, struct error *error);
uint64_t gpu_scene_device_bytes(const struct gpu_scene *gpu);

#endif
