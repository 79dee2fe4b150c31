/* SPDX-License-Identifier: MIT */
/* Calls the functions of shaders/common/bsdf.glsl on the device, for any material: a test of them is a test of
 * what the integrator uses, not of a copy. The normal is +z, the grain runs along x. */
#ifndef FARLIGHT_TESTS_BSDF_PROBE_H
#define FARLIGHT_TESTS_BSDF_PROBE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "gpu/buffer.h"
#include "gpu/device.h"
#include "shared/bindings.h"
#include "tests/fixtures/shader_probe.h"

#include <epoxy/gl.h>
#include <string.h>

/* Layout of the shader's struct: five vec4. */
struct bsdf_case {
    float roughness, metallic, transmission, ior;
    float view[3], base;             /* unit, towards the eye; base colour, grey */
    float inside, anisotropy;        /* inside 1: seen from behind, as glass is */
    float specular, specular_colour; /* for a probe with specular reflection; grey */
    float coat, coat_roughness;      /* for a probe with a coat */
    float coat_turn;               /* angle of the coat's normal from the surface's in the plane y = 0, radians */
    float film, film_ior, film_nm; /* for a probe with a thin film */
    float unused[2];
};
_Static_assert(sizeof(struct bsdf_case) == 80, "the shader reads five vec4 a case");

/* A question to the shader: a direction to evaluate, or three numbers to choose by. */
struct bsdf_question {
    float v[4]; /* direction; or u, u, choice */
};

struct bsdf_answer {
    float direction[3], lobe;            /* given, or chosen, BSDF_* */
    float weight, probability, sent, of; /* weight of what was chosen; bsdf_evaluate() of the direction and its
                                            probability; `of`: reflected() of common/scattering.glsl */
};

struct bsdf_probe {
    struct gpu_device *device;
    struct gpu_program program;
    struct gpu_buffer questions, answers;
};

static const char bsdf_probe_text[] =
    "#include \"shared/bindings.h\"\n"
    "#define GROUP_SIZE 1024\n" /* software GL allocates for each group, which is slow below a sanitizer */
    "#include \"common/dispatch.glsl\"\n"
    "#include \"common/bsdf.glsl\"\n"
    "uniform uint question_count, chooses;\n"
    "uniform vec4 material_, view_base, more, coat, film;\n"
    "layout(std430, binding = BIND_PASS_1) readonly buffer question_block { vec4 questions[]; };\n"
    "layout(std430, binding = BIND_PASS_2) writeonly buffer answer_block { vec4 answers[]; };\n"
    "void main()\n"
    "{\n"
    "    uint i = item_index();\n"
    "    if (i >= question_count)\n"
    "        return;\n"
    "    surface s;\n"
    "    s.position = s.emission = vec3(0.0);\n"
    "    s.geometric = s.normal = vec3(0.0, 0.0, 1.0);\n"
    "    s.base = vec3(view_base.w);\n"
    "    s.alpha = s.occlusion = 1.0;\n"
    "    s.unlit = false;\n"
    "    s.roughness = material_.x;\n"
    "    s.metallic = material_.y;\n"
    "    s.transmission = material_.z;\n"
    "    s.ior = material_.w;\n"
    "    s.inside = more.x > 0.0;\n"
    "    s.along = vec3(1.0, 0.0, 0.0);\n"
    "    s.grain = vec3(s.along.xy, more.y);\n"
    "#ifdef HAS_SPECULAR\n"
    "    s.specular = more.z;\n"
    "    s.specular_colour = vec3(more.w);\n"
    "#endif\n"
    "#ifdef HAS_CLEARCOAT\n"
    "    s.coat = coat.x;\n"
    "    s.coat_roughness = coat.y;\n"
    "    s.coat_normal = vec3(sin(coat.z), 0.0, cos(coat.z));\n"
    "#endif\n"
    "#ifdef HAS_IRIDESCENCE\n"
    "    s.film = coat.w;\n"
    "    s.film_ior = film.x;\n"
    "    s.film_nm = film.y;\n"
    "#endif\n"
    "    vec3 view = view_base.xyz;\n"
    "    split parts = split_light(s, view, view.z);\n"
    "    bsdf b = bsdf_of(s, view, view.z);\n"
    "    vec4 asked = questions[i];\n"
    "    bsdf_choice chosen = bsdf_choice(asked.xyz, vec3(0.0), 0.0, BSDF_SCATTERED);\n"
    "    float choice = asked.z, probability;\n"
    "    if (chooses != 0u)\n"
    "        chosen = bsdf_choose(b, s, choice, asked.xy);\n"
    "    vec3 sent = bsdf_evaluate(b, s, chosen.direction, probability);\n"
    "    float other = reflected(s, parts, view, view.z, chosen.direction).g;\n"
    "    if (chooses != 0u)\n"
    "        probability = chosen.probability;\n"
    "    answers[2u * i] = vec4(chosen.direction, float(chosen.lobe));\n"
    "    answers[2u * i + 1u] = vec4(chosen.weight.g, probability, sent.g, other);\n"
    "}\n";

/* `more`: a define, or NULL. */
static inline void bsdf_probe_init(struct bsdf_probe *probe, struct gpu_device *device, const char *more)
{
    const struct gpu_define defines[] = {{"HAS_ANISOTROPY", "1"}, {more, "1"}, {NULL, NULL}};
    *probe = (struct bsdf_probe){.device = device, .program = shader_probe_compile(bsdf_probe_text, defines)};
}

static inline void bsdf_probe_finish(struct bsdf_probe *probe)
{
    gpu_buffer_finish(probe->device, &probe->questions);
    gpu_buffer_finish(probe->device, &probe->answers);
    shader_probe_finish(&probe->program);
}

static inline void bsdf_probe_ask(struct bsdf_probe *probe, const struct bsdf_question *questions, size_t count)
{
    struct error error = {0};
    assert_true(
        gpu_buffer_upload(probe->device, &probe->questions, questions, count * sizeof(*questions), &error));
    assert_true(gpu_buffer_reserve(probe->device, &probe->answers, count * sizeof(struct bsdf_answer), &error));
}

/* Answers to the questions that were asked last; `chooses`: they are numbers to choose by. */
static inline void bsdf_probe_run(struct bsdf_probe *probe, const struct bsdf_case *c, bool chooses, size_t count,
                                  struct bsdf_answer *answers)
{
    struct error error = {0};
    gpu_uniform_uint(&probe->program, "question_count", (uint32_t)count);
    gpu_uniform_uint(&probe->program, "chooses", chooses);
    gpu_uniform_vec(&probe->program, "material_", 4, &c->roughness);
    gpu_uniform_vec(&probe->program, "view_base", 4, c->view);
    gpu_uniform_vec(&probe->program, "more", 4, &c->inside);
    gpu_uniform_vec(&probe->program, "coat", 4, &c->coat);
    gpu_uniform_vec(&probe->program, "film", 4, &c->film_ior);
    gpu_buffer_bind_storage(&probe->questions, BIND_PASS_1);
    gpu_buffer_bind_storage(&probe->answers, BIND_PASS_2);
    gpu_dispatch(probe->device, &probe->program, count);
    gpu_buffer_read(probe->device, &probe->answers, 0, answers, count * sizeof(*answers));
    if (!gpu_check(probe->device, "bsdf probe", &error))
        fail_msg("%s", error.text);
}

#endif
