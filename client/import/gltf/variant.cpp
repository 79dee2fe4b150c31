// SPDX-License-Identifier: MIT
// KHR_materials_variants: sets of materials, of which the user may choose one by name.
#include "reader.hpp"

namespace gltf
{
namespace
{
const char *const name = "KHR_materials_variants";

// Formats "it has 'a', 'b'".
std::string listed(const tinygltf::Value &variants)
{
    std::string list;

    for (size_t i = 0; i < variants.ArrayLen() && list.size() < 300; i++)
        list += (i == 0 ? "'" : ", '") + text_of(variants.Get(int(i)), "name").substr(0, 100) + "'";
    return list;
}
} // namespace

void choose_variant(reader &r)
{
    const char *wanted = r.scene->variant;
    const tinygltf::Value *list = extension(r.model.extensions, name);

    r.variant = -1;
    if (!list || !list->Has("variants") || !list->Get("variants").IsArray() ||
        list->Get("variants").ArrayLen() == 0) {
        if (wanted)
            fail(r, "", "the model has no variants, so none can be called '%.100s'", wanted);
        return;
    }
    const tinygltf::Value &variants = list->Get("variants");
    for (size_t i = 0; i < variants.ArrayLen(); i++) {
        const std::string one = text_of(variants.Get(int(i)), "name");
        import_list_variant(r.scene, one.c_str());
        if (wanted && r.variant < 0 && one == wanted)
            r.variant = int(i);
    }
    check(r);
    if (wanted && r.variant < 0)
        fail(r, "", "the model has no variant '%.100s'; it has %s", wanted, listed(variants).c_str());
}

int material_of(const reader &r, const tinygltf::Primitive &primitive)
{
    const tinygltf::Value *own = r.variant < 0 ? nullptr : extension(primitive.extensions, name);

    if (!own || !own->Has("mappings") || !own->Get("mappings").IsArray())
        return primitive.material;
    const tinygltf::Value &mappings = own->Get("mappings");
    for (size_t i = 0; i < mappings.ArrayLen(); i++) {
        const tinygltf::Value &mapping = mappings.Get(int(i));
        if (!mapping.IsObject() || !mapping.Has("variants") || !mapping.Get("variants").IsArray())
            continue;
        const tinygltf::Value &variants = mapping.Get("variants");
        for (size_t k = 0; k < variants.ArrayLen(); k++)
            if (variants.Get(int(k)).IsNumber() && variants.Get(int(k)).GetNumberAsInt() == r.variant)
                return index_of(mapping, "material");
    }
    return primitive.material;
}
} // namespace gltf
