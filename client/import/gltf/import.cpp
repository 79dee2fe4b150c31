// SPDX-License-Identifier: MIT
// Import of glTF files.
#include "import.h"
#include "reader.hpp"

#include <algorithm>
#include <cmath>
#include <new>

namespace gltf
{
namespace
{
void import(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    load(r, bytes, size_bytes);
    note_unknown_extensions(r);
    choose_variant(r);
    check_hierarchy(r);
    r.material_ids.assign(r.model.materials.size(), 0);
    add_scene(r);
    add_clips(r);
}
} // namespace

float limited(reader &r, const std::string &where, const char *what, double value, double minimum, double maximum)
{
    if (value >= minimum && value <= maximum)
        return float(value);
    const double cut = value > maximum ? maximum : minimum; // NaN becomes the minimum
    import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(), "%s is %g; it was set to %g", what, value, cut);
    return float(cut);
}
} // namespace gltf

extern "C" bool gltf_import(struct import_scene *scene, struct files *files, const unsigned char *bytes,
                            size_t size_bytes)
{
    return reading::run(scene, "out of memory", [&] {
        gltf::reader r = {};
        r.scene = scene;
        r.files = files;
        gltf::import(r, bytes, size_bytes);
    });
}
