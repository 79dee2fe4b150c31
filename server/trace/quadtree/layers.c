#include "trace/quadtree/layers.h"
#include "gpu/program.h"
#include <epoxy/gl.h>
bool quadtree_layers_begin(struct quadtree_layers *l, struct quadtree_store *s, struct error *error)
{
    l->store = s;
    for (int i = 0; i < 2; i++)
        if (!gpu_texture_reserve(s->device, &l->depth[i], GL_DEPTH_COMPONENT32F, s->uniforms.padded_width, s->uniforms.padded_height, error)) return false;
    for (unsigned i = 0; i < s->uniforms.faces * s->uniforms.layers; i++) {
        gpu_framebuffer_finish(s->device, &l->f[i]);
        if (!gpu_framebuffer_create_layer(s->device, &l->f[i], &s->visible, i, &l->depth[i % s->uniforms.layers % 2], error)) return false;
    }
    return true;
}
enum tracer_progress quadtree_layers_go_on(struct quadtree_layers *l, struct gpu_scene *scene, bool at_once, struct error *error)
{
    (void)at_once;
    struct quadtree_store *s = l->store;
    const struct gpu_program_source source = {.vertex = "quadtree/tmp.vert", .fragment = "quadtree/tmp.frag"};
    const struct gpu_program *p = gpu_program_get(s->device, &source, error);
    if (!p) return TRACER_FAILED;
    static const GLuint nothing[4] = {0}; static const GLfloat farthest = 0;
    glDisable(GL_BLEND); glDisable(GL_SCISSOR_TEST); glDisable(GL_CULL_FACE);
    glEnable(GL_DEPTH_TEST); glDepthMask(GL_TRUE); glDepthFunc(GL_GREATER); glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    for (unsigned i = 0; i < s->uniforms.faces * s->uniforms.layers; i++) {
        unsigned layer = i % s->uniforms.layers;
        glBindFramebuffer(GL_FRAMEBUFFER, l->f[i].name);
        glViewport(0, 0, (GLsizei)s->uniforms.width, (GLsizei)s->uniforms.height);
        glClearNamedFramebufferuiv(l->f[i].name, GL_COLOR, 0, nothing);
        glClearNamedFramebufferfv(l->f[i].name, GL_DEPTH, 0, &farthest);
        gpu_buffer_bind_uniform(&s->uniform_buffer, UNIFORM_QUADTREE);
        gpu_texture_bind(&l->depth[(layer + 1) % 2], UNIT_QUADTREE_DEPTH);
        for (unsigned k = 0; k < scene->instance_count; k++) {
            const struct geometry *g = &scene->geometries[scene->instances[k].geometry].device;
            if (g->kind == GEOMETRY_SPHERES) continue;
            gpu_uniform_uint(p, "instance_index", k); gpu_uniform_uint(p, "first_primitive", g->first_primitive);
            gpu_uniform_uint(p, "face", i / s->uniforms.layers); gpu_uniform_uint(p, "layer", layer);
            gpu_program_use(s->device, p);
            glDrawArrays(GL_TRIANGLES, 0, (GLsizei)(3 * g->primitive_count));
        }
    }
    glDisable(GL_DEPTH_TEST); glBindFramebuffer(GL_FRAMEBUFFER, 0);
    gpu_finish(s->device);
    return TRACER_DONE;
}
void quadtree_layers_finish(struct quadtree_layers *l)
{
    if (!l->store) return;
    for (int i = 0; i < 36; i++) gpu_framebuffer_finish(l->store->device, &l->f[i]);
    for (int i = 0; i < 2; i++) gpu_texture_finish(l->store->device, &l->depth[i]);
    l->store = NULL;
}
uint64_t quadtree_layers_bytes(const struct quadtree_layers *l) { return l->depth[0].size_bytes + l->depth[1].size_bytes; }
