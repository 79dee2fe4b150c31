#ifndef L_H
#define L_H
#include "trace/quadtree/store.h"
#include "trace/step.h"
struct quadtree_layers { struct quadtree_store *store; struct gpu_texture depth[2]; struct gpu_framebuffer f[36]; };
bool quadtree_layers_begin(struct quadtree_layers *l, struct quadtree_store *s, struct error *error);
enum tracer_progress quadtree_layers_go_on(struct quadtree_layers *l, struct gpu_scene *scene, bool at_once, struct error *error);
void quadtree_layers_finish(struct quadtree_layers *l);
uint64_t quadtree_layers_bytes(const struct quadtree_layers *l);
#endif
