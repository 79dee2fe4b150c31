/* SPDX-License-Identifier: MIT */
/* The device's copy of a scene, by revision; shared by all tracers and integrators. */
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

/* The kinds of change between two frames, as bits. A tracer says with the same bits what its structure is built
 * from (tracer_impl.depends_on). */
enum scene_change {
    CHANGED_GEOMETRY = 1 << 0, /* meshes or sphere sets were added, removed or set again */
    CHANGED_DEFORMED =
        1 << 1, /* vertices of deforming geometries moved; which: gpu_scene_geometry.deformed_revision */
    CHANGED_INSTANCES = 1 << 2, /* transforms, or which instances there are */
    CHANGED_DISCS = 1 << 3,     /* discs, which no structure of the scene holds but the reference's */
    CHANGED_SHADING = 1 << 4,   /* materials, textures; alpha too */
    CHANGED_SURFACES =
        1 << 5,              /* of these: textures, how materials use them, and where they cut out; not factors */
    CHANGED_LIGHTS = 1 << 6, /* lights and the environment */
    CHANGED_VIEW = 1 << 7,   /* the camera, or the size of the picture: struct trace_view. Never of a scene */
};
#define CHANGED_SCENE (CHANGED_VIEW - 1u) /* all that a scene can change */
/* Of a structure that is built for the first time. */
#define CHANGED_ALL (CHANGED_SCENE | (unsigned)CHANGED_VIEW)

/* What one update of the copy changed. */
struct scene_changes {
    unsigned bits; /* enum scene_change */
    uint64_t uploaded_bytes;
};

/* Host-side mirror of the arrays that builders need, in device order. */
struct gpu_scene_geometry {
    struct geometry device;
    const struct scene_mesh *mesh; /* one of these two; valid until the scene is edited */
    const struct scene_spheres *spheres;
    uint64_t revision; /* of the object: unchanged means the same primitives, and the same shape where node is 0 */
    uint32_t id;       /* the object's id; unique together with `node` and which of the two is set */
    uint32_t node; /* deforms the mesh, and is the only one that shows this geometry; 0: the mesh as it is, or a
                      set of spheres. With a skin its vertices are in world space, and the transform of its
                      instance is the identity */
    uint64_t deformed_revision; /* counts up whenever its vertices, or those as the shutter closes, are others; 0:
                                   they are those of the mesh */
    float lower[3], upper[3];   /* bounds in object space while the shutter is open; of what deforms conservative:
                                   from its joints and weights, to rounding */
};

struct gpu_scene {
    struct gpu_device *device;
    const struct scene *scene;         /* of the last update, for tracers on the host; valid until it is edited */
    const struct scene_motion *motion; /* likewise; NULL: things are as they were committed. The caller's: valid as
                                          long as it keeps it, which is until the tracers are up to date */
    uint64_t revision;                 /* of the scene that is on the device */
    struct gpu_scene_geometry *geometries;
    uint32_t geometry_count;
    struct instance *instances; /* mirror of the buffer */
    uint32_t instance_count;
    float (*motions)[12];  /* mirror of the buffer: that of instance i begin at (instances[i].motion - 1) / 3 */
    uint32_t motion_count; /* matrices */
    struct disc *discs;
    uint32_t disc_count;
    uint32_t material_count, light_count;
    bool has_spheres;     /* some geometry is a set of spheres */
    bool has_cutout;      /* some material in use is alpha mode mask: tracers must ask for alpha */
    bool has_translucent; /* some material lets shadow rays pass: blend or transmission */
    bool has_transmission;
    bool has_varied_alpha; /* what one of these lets pass differs from place to place: texture or vertex colours */
    bool has_texcoords;    /* some mesh has texture coordinates */
    bool has_colours;      /* some mesh has vertex colours */
    bool has_tangents;     /* some mesh has tangents, or some material in use asks for those of its texture
                              coordinates: normal or bump map, anisotropy */
    bool has_motion;       /* something moves while the shutter is open: tracers must look at the rays' times */
    bool has_emitters;     /* some emissive triangle is in the tables of shared/emitter.h */
    bool has_lamps;        /* some of these is brighter than 1, what reflects most in the light of 1 */
    bool has_emissive_spheres; /* some material of spheres would make triangles such */
    bool has_environment_image;
    float lower_world[3], upper_world[3]; /* all instances and lights with a place; discs left out */
    float diagonal;                       /* of these bounds */
    /* buffers as shared/geometry.h, shared/tables.h and shared/material.h describe them */
    struct gpu_buffer triangles, positions, normals, tangents, texcoords, colours, spheres, sphere_materials;
    struct gpu_buffer instance_buffer, motion_buffer, tables, texels, lights;
    struct table_starts table_starts; /* mirror of the head of `tables` */
    struct gpu_texture environment;
    float environment_colour[3], environment_rotation;
    uint64_t geometry_revision, instances_revision, shading_revision, lights_revision; /* of what is there */
    uint64_t deformed_revision;    /* the last number given out; continues when the copy is made again, as tracers
                                      identify kept data by it */
    struct gpu_scene_state *state; /* private to gpu_scene/: the parts that need not be uploaded again */
};

void gpu_scene_init(struct gpu_scene *gpu, struct gpu_device *device);
void gpu_scene_finish(struct gpu_scene *gpu);
/* Brings the copy to the scene's revision and to the poses while the shutter is open (NULL: as committed);
 * *changes says what changed. Materials, lights and their transforms, and hidden nodes are those of the first
 * pose. Instances whose transform is singular in some pose are left out. On failure the copy is empty, and the
 * next update makes it again. */
bool gpu_scene_update(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                      struct scene_changes *changes, struct stage_times *times, struct error *error);
/* After an update, for integrators that ask emissive triangles for light: `has_emitters`, `has_lamps` and their
 * tables become what the update has brought. Of many such triangles the tree takes a while, which others do
 * without. Fails like gpu_scene_update(). */
bool gpu_scene_update_emitters(struct gpu_scene *gpu, struct scene_changes *changes, struct stage_times *times,
                               struct error *error);
/* Whether it would change nothing. */
bool gpu_scene_emitters_are_current(const struct gpu_scene *gpu);
/* Brings what is large of the scene to the device, until about `end_ns` of the clock: triangles, vertices,
 * textures. *done: all is there, and the update will not take long for it. An update without it does all at once.
 * Between two steps the scene must not change, and nobody may use the copy. Fails like gpu_scene_update();
 * ERROR_BUSY: memory is reserved in steps, and the next one goes on. */
bool gpu_scene_bring(struct gpu_scene *gpu, const struct scene *scene, uint64_t end_ns, bool *done,
                     struct stage_times *times, struct error *error);
/* Whether the next step would only wait. */
bool gpu_scene_bring_waits(struct gpu_scene *gpu);
/* Gives up what is not done: then the copy is empty. */
void gpu_scene_bring_abandon(struct gpu_scene *gpu);
/* Whether an update would change nothing. */
bool gpu_scene_is_current(const struct gpu_scene *gpu, const struct scene *scene,
                          const struct scene_motion *motion);
/* Where an instance is in each pose, one if it stands still: world_from_object, borrowed from the copy. */
const float (*gpu_scene_poses(const struct gpu_scene *gpu, const struct instance *instance,
                              uint32_t *pose_count))[12];
/* Of an instance in world space, wherever it goes while the shutter is open. */
void gpu_scene_instance_bounds(const struct gpu_scene *gpu, uint32_t instance, float lower_world[3],
                               float upper_world[3]);
/* Binds every buffer and texture at its place of shared/bindings.h. */
void gpu_scene_bind(struct gpu_scene *gpu);
/* Uploads the environment's image after an update, until about `end_ns`, in as many calls as it takes. No frame
 * may show it before it is `done`. Fails as gpu_texture_reserve(), also where that is put off. */
bool gpu_scene_upload_environment(struct gpu_scene *gpu, uint64_t end_ns, bool *done, struct error *error);
uint64_t gpu_scene_device_bytes(const struct gpu_scene *gpu);

#endif
