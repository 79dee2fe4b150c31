// SPDX-License-Identifier: MIT
// 3MF: the elements of its models. Expat reads the XML; it knows no recursion, and documents with a DTD are
// refused.
#include "import.h"

#include "reader.hpp"

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>

#include <expat.h>

namespace threemf
{
namespace
{
// The name without the prefix of its namespace.
const char *local(const char *name)
{
    const char *colon = strrchr(name, ':');
    return colon ? colon + 1 : name;
}

// A file of the archive.
class model_file
{
  public:
    model_file(reader &from, std::string file, bool is_the_main_one)
        : r(from), name(std::move(file)), is_main(is_the_main_one), parser(XML_ParserCreate(nullptr))
    {
        if (!parser)
            throw std::bad_alloc();
        XML_SetUserData(parser.get(), this);
        XML_SetElementHandler(parser.get(), on_start, on_end);
        XML_SetStartDoctypeDeclHandler(parser.get(), on_doctype);
    }
    void parse(const char *bytes, size_t size_bytes, bool is_last)
    {
        const XML_Status status = XML_Parse(parser.get(), bytes, int(size_bytes), is_last);
        if (fault)
            std::rethrow_exception(fault);
        if (status != XML_STATUS_OK)
            fail(r, place(), "the 3MF file cannot be read: %s", XML_ErrorString(XML_GetErrorCode(parser.get())));
    }

  private:
    struct free_parser {
        void operator()(XML_ParserStruct *p) const
        {
            XML_ParserFree(p);
        }
    };
    reader &r;
    const std::string name;
    const bool is_main;
    const std::unique_ptr<XML_ParserStruct, free_parser> parser;
    std::exception_ptr fault = nullptr; // exception of a handler, kept from the parser, which is C
    const char **attributes = nullptr;  // attributes of the current element
    std::map<uint32_t, group> groups = {};
    group *open_group = nullptr;
    object building = {};
    geometry mesh = {};
    uint32_t object_id = none, object_group = none, object_property = none;

    std::string place() const
    {
        return name + " line " + std::to_string(XML_GetCurrentLineNumber(parser.get()));
    }
    const char *attribute(const char *key) const
    {
        for (const char **at = attributes; at[0]; at += 2)
            if (strcmp(local(at[0]), key) == 0)
                return at[1];
        return nullptr;
    }
    uint32_t whole(const char *key, uint32_t otherwise) const
    {
        const char *text = attribute(key);
        char *end = nullptr;
        const unsigned long value = text ? strtoul(text, &end, 10) : otherwise;
        if (text && (end == text || *end != '\0' || value >= none))
            fail(r, place(), "'%.40s' is no number of '%s'", text, key);
        return uint32_t(value);
    }
    uint32_t needed(const char *key) const
    {
        const uint32_t value = whole(key, none);
        if (value == none)
            fail(r, place(), "an element has no '%s'", key);
        return value;
    }
    float real(const char *&text, const char *key) const
    {
        char *end = nullptr;
        const float value = text ? strtof(text, &end) : 0;
        if (!text || end == text || !std::isfinite(value))
            fail(r, place(), "'%.40s' is no number of '%s'", text ? text : "", key);
        text = end;
        return value;
    }
    // Reads a transform, which multiplies row vectors from the right.
    instance read_instance() const
    {
        const char *path = attribute("path"), *text = attribute("transform");
        instance made = {{part_name(path ? path : name), needed("objectid")}, {}};

        import_identity(made.parent_from_object);
        for (size_t i = 0; text && i < 12; i++)
            made.parent_from_object[i % 3 * 4 + i / 3] = real(text, "transform");
        return made;
    }
    void read_unit() const
    {
        static const std::pair<const char *, double> units[] = {{"micron", 1e-6},     {"millimeter", 1e-3},
                                                                {"centimeter", 1e-2}, {"inch", 0.0254},
                                                                {"foot", 0.3048},     {"meter", 1}};
        const char *unit = attribute("unit");
        for (const auto &one : units)
            if (unit && strcmp(unit, one.first) == 0)
                r.metres = one.second;
    }
    void read_colour(const char *text, const char *of)
    {
        unsigned c[4] = {255, 255, 255, 255};
        if (!open_group)
            return;
        if (!text || sscanf(text, "#%2x%2x%2x%2x", &c[0], &c[1], &c[2], &c[3]) < 3)
            fail(r, place(), "'%.40s' is no colour such as #FF8000", text ? text : "");
        open_group->colours.push_back({uint8_t(c[0]), uint8_t(c[1]), uint8_t(c[2]), uint8_t(c[3])});
        open_group->names.emplace_back(of ? of : "");
    }
    void read_triangle()
    {
        triangle t = {{needed("v1"), needed("v2"), needed("v3")}, whole("pid", none), {none, none, none}};

        for (const uint32_t corner : t.corners)
            if (corner >= mesh.positions.size() / 3)
                fail(r, place(), "a triangle has the vertex %u, but there are %zu", corner,
                     mesh.positions.size() / 3);
        const uint32_t first = whole("p1", none);
        t.properties = {first, whole("p2", first), whole("p3", first)};
        if (first == none) {
            t.group_id = object_group;
            t.properties = {object_property, object_property, object_property};
        } else if (t.group_id == none) {
            t.group_id = object_group;
        }
        mesh.triangles.push_back(t);
    }
    void begin_object()
    {
        building = {};
        mesh = {};
        object_id = needed("id");
        object_group = whole("pid", none);
        object_property = whole("pindex", none);
        building.name = attribute("name") ? attribute("name") : "";
    }
    void end_object()
    {
        if (!mesh.triangles.empty())
            building.mesh = add_mesh(r, building.name, mesh, groups);
        r.objects[{part_name(name), object_id}] = std::move(building);
        mesh = {};
        object_id = none;
    }
    void begin(const char *element)
    {
        const auto is = [element](const char *word) { return strcmp(element, word) == 0; };

        if (is("vertex") && object_id != none) {
            for (const char *axis : {"x", "y", "z"}) {
                const char *text = attribute(axis);
                mesh.positions.push_back(real(text, axis));
            }
        } else if (is("triangle") && object_id != none) {
            read_triangle();
        } else if (is("object")) {
            begin_object();
        } else if (is("component") && object_id != none) {
            building.components.push_back(read_instance());
        } else if (is("item") && is_main) {
            r.items.push_back(read_instance());
        } else if (is("basematerials") || is("colorgroup")) {
            open_group = &(groups[needed("id")] = {});
            open_group->has_materials = is("basematerials");
        } else if (is("base")) {
            read_colour(attribute("displaycolor"), attribute("name"));
        } else if (is("color")) {
            read_colour(attribute("color"), nullptr);
        } else if (is("model") && is_main) {
            read_unit();
        } else if (is("texture2dgroup") || is("compositematerials") || is("multiproperties")) {
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, place().c_str(),
                        "textures and mixtures of 3MF files are not supported: objects with them are grey");
        } else if (is("beamlattice")) {
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, place().c_str(), "beams of 3MF files are not shown");
        }
    }
    void end(const char *element)
    {
        if (strcmp(element, "object") == 0 && object_id != none)
            end_object();
        if (strcmp(element, "basematerials") == 0 || strcmp(element, "colorgroup") == 0)
            open_group = nullptr;
    }
    void guarded(const std::function<void()> &work)
    {
        if (fault)
            return;
        try {
            work();
        } catch (...) {
            fault = std::current_exception();
            XML_StopParser(parser.get(), XML_FALSE);
        }
    }
    static void XMLCALL on_start(void *user, const char *element, const char **attributes)
    {
        model_file &file = *static_cast<model_file *>(user);
        file.attributes = attributes;
        file.guarded([&] { file.begin(local(element)); });
    }
    static void XMLCALL on_end(void *user, const char *element)
    {
        model_file &file = *static_cast<model_file *>(user);
        file.guarded([&] { file.end(local(element)); });
    }
    static void XMLCALL on_doctype(void *user, const char *, const char *, const char *, int)
    {
        model_file &file = *static_cast<model_file *>(user);
        file.guarded([&] { fail(file.r, file.place(), "a 3MF file must not have a DTD"); });
    }
};

void import(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    each_model(r, bytes, size_bytes, [&](const std::string &name, bool is_main) {
        const auto file = std::make_shared<model_file>(r, name, is_main);
        return
            [file](const char *part, size_t part_bytes, bool is_last) { file->parse(part, part_bytes, is_last); };
    });
    add_items(r);
}
} // namespace
} // namespace threemf

extern "C" bool threemf_import(struct import_scene *scene, const unsigned char *bytes, size_t size_bytes)
{
    const char *too_large = "the file needs more memory than a model may have: split it into parts";
    return reading::run(scene, too_large, [&] {
        threemf::reader r = {{scene}};
        threemf::import(r, bytes, size_bytes);
    });
}
