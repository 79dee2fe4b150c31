// SPDX-License-Identifier: MIT
// Mending of COLLADA files, where this version of the library would lose a camera or a mesh. Every search ends
// with the element that it examines, so that the time is linear in the file's size.
#include "reader.hpp"

#include <cctype>
#include <string_view>

namespace assimp
{
namespace
{
using view = std::string_view;
constexpr size_t none = view::npos;

// The tag from the element's name to its '>'; empty: there is none.
view tag_at(view all, size_t at)
{
    const size_t end = all.find('>', at);
    return end == none ? view() : all.substr(at, end - at);
}

// The value within quotes; empty: the element lacks the attribute.
view attribute(view tag, view name)
{
    for (size_t at = tag.find(name); at != none; at = tag.find(name, at + 1)) {
        const size_t quote = at + name.size() + 1;
        if (at == 0 || !isspace(static_cast<unsigned char>(tag[at - 1])) || quote >= tag.size() ||
            tag[quote - 1] != '=' || (tag[quote] != '"' && tag[quote] != '\''))
            continue;
        const size_t stop = tag.find(tag[quote], quote + 1);
        return stop == none ? view() : tag.substr(quote + 1, stop - quote - 1);
    }
    return {};
}

std::string without_comments(view all)
{
    std::string kept;
    size_t copied = 0;

    for (size_t at = all.find("<!--"); at != none; at = all.find("<!--", copied)) {
        const size_t stop = all.find("-->", at);
        kept.append(all.substr(copied, at - copied));
        if (stop == none)
            return kept;
        copied = stop + 3;
    }
    return kept.append(all.substr(copied));
}

// References to meshes by references to morph controllers, "#id", that move them.
using references = std::map<std::string, std::string, std::less<>>;

std::string without_morphs(view all, references &meshes)
{
    constexpr view opening = "<controller", closing = "</controller>";
    std::string kept;
    size_t copied = 0;

    for (size_t at = all.find(opening); at != none; at = all.find(opening, at)) {
        const size_t stop = all.find(closing, at);
        if (stop == none)
            break;
        const view element = all.substr(at, stop - at);
        const size_t morph = element.find("<morph");
        if (morph != none) {
            const std::string id(attribute(tag_at(element, 0), "id"));
            meshes["#" + id] = attribute(tag_at(element, morph), "source");
            kept.append(all.substr(copied, at - copied));
            copied = stop + closing.size();
        }
        at = stop + closing.size();
    }
    return kept.append(all.substr(copied));
}

// Replaces references of skins and nodes to a morph controller by its mesh.
std::string with_meshes(view all, const references &meshes)
{
    constexpr view skin = "<skin ", instance = "<instance_controller ", instance_end = "</instance_controller>";
    std::string made;
    size_t copied = 0;
    bool is_renamed = false;

    for (size_t at = all.find('<'); at != none; at = all.find('<', at + 1)) {
        const view rest = all.substr(at, instance_end.size());
        const bool is_skin = rest.substr(0, skin.size()) == skin;
        if (is_renamed && rest == instance_end) {
            made.append(all.substr(copied, at - copied)).append("</instance_geometry>");
            copied = at + instance_end.size();
            is_renamed = false;
        }
        if (!is_skin && rest.substr(0, instance.size()) != instance)
            continue;
        const view tag = tag_at(all, at), from = attribute(tag, is_skin ? "source" : "url");
        const auto found = meshes.find(from);
        if (from.empty() || found == meshes.end())
            continue;
        const size_t value = size_t(from.data() - all.data());
        made.append(all.substr(copied, at - copied));
        copied = is_skin ? at : at + instance.size();
        made.append(is_skin ? view() : "<instance_geometry ");
        made.append(all.substr(copied, value - copied)).append(found->second);
        copied = value + from.size();
        is_renamed = !is_skin && tag.back() != '/';
    }
    return made.append(all.substr(copied));
}

// Adds names to cameras without one: this version skips them, although COLLADA does not require names.
std::string with_named_cameras(view all)
{
    constexpr view opening = "<camera ";
    std::string made;
    size_t copied = 0;

    for (size_t at = all.find(opening); at != none; at = all.find(opening, at + 1)) {
        const view tag = tag_at(all, at);
        if (tag.empty())
            break;
        if (tag.find("name=") != none)
            continue;
        made.append(all.substr(copied, at + opening.size() - copied)).append("name=\"\" ");
        copied = at + opening.size();
    }
    return made.append(all.substr(copied));
}
} // namespace

std::string mend_collada(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    std::string all = with_named_cameras({reinterpret_cast<const char *>(bytes), size_bytes});

    if (all.find("<morph ") != none) {
        references meshes;
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, "",
                    "morph targets of COLLADA files are not read: meshes are shown without; write it as glTF");
        all = without_morphs(without_comments(all), meshes);
        all = with_meshes(all, meshes);
    }
    return all;
}
} // namespace assimp
