// SPDX-License-Identifier: MIT
// Primitives compressed with Draco. The library trusts the counts in its header, so they are read in advance and
// compared with the accessors', which must be equal (KHR_draco_mesh_compression, "conformance").
#include "reader.hpp"

#include <algorithm>
#include <cstring>
#include <memory>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#include <draco/compression/decode.h>
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/varint_decoding.h>
#pragma GCC diagnostic pop

namespace gltf
{
namespace
{
constexpr int attributes_max = 32, components_max = 4;
// A plane of a million triangles, all deltas zero, needs a byte for 28 of them at the highest compression.
constexpr size_t triangles_per_byte_max = 256;
// Bitstreams before 2.2 do not occur in glTF: its encoders write 2.2.
constexpr uint16_t bitstream_version = DRACO_BITSTREAM_VERSION(2, 2);

struct limits {
    uint32_t faces, points;
    uint64_t bytes; // size of all attributes
    std::string *reason;
};

// A decoder that stops at unexpected counts before it allocates memory for them.
template <typename base> class bounded : public base
{
  public:
    explicit bounded(const limits &wanted) : wanted_(wanted)
    {
    }

  protected:
    bool refuse(const char *what, uint64_t found, uint64_t wanted)
    {
        *wanted_.reason =
            std::to_string(found) + " " + what + ", where the accessors have " + std::to_string(wanted);
        return false;
    }
    bool exceed(const char *what, uint64_t found, uint64_t maximum)
    {
        *wanted_.reason =
            std::to_string(found) + " " + what + "; at most " + std::to_string(maximum) + " are allowed";
        return false;
    }
    bool DecodeConnectivity() override
    {
        draco::DecoderBuffer ahead = *this->buffer();
        uint32_t faces = 0, points = 0;
        const bool edges = std::is_same<base, draco::MeshEdgebreakerDecoder>::value;

        if (this->bitstream_version() != bitstream_version) {
            *wanted_.reason = "the version of its bitstream is not 2.2";
            return false;
        }
        // Edgebreaker has fewer vertices than points where seams divide them.
        uint32_t &first = edges ? points : faces, &second = edges ? faces : points;
        const bool read = draco::DecodeVarint(&first, &ahead) && draco::DecodeVarint(&second, &ahead);
        if (!read)
            return false;
        if (faces != wanted_.faces)
            return refuse("triangles", faces, wanted_.faces);
        if (edges ? points > wanted_.points : points != wanted_.points)
            return refuse("vertices", points, wanted_.points);
        if (!base::DecodeConnectivity())
            return false;
        return this->point_cloud()->num_points() == wanted_.points ||
               refuse("vertices", this->point_cloud()->num_points(), wanted_.points);
    }
    // The attributes are known here, but not decoded yet.
    bool DecodeAllAttributes() override
    {
        const draco::PointCloud &cloud = *this->point_cloud();
        uint64_t bytes = 0;

        if (cloud.num_attributes() > attributes_max)
            return exceed("attributes", uint64_t(cloud.num_attributes()), attributes_max);
        for (int i = 0; i < cloud.num_attributes(); i++) {
            const draco::PointAttribute &attribute = *cloud.attribute(i);
            if (attribute.num_components() > components_max)
                return exceed("components", uint64_t(attribute.num_components()), components_max);
            bytes += uint64_t(attribute.byte_stride()) * wanted_.points;
        }
        return bytes <= wanted_.bytes ? base::DecodeAllAttributes() : exceed("bytes", bytes, wanted_.bytes);
    }

  private:
    const limits wanted_;
};

struct decoding {
    reader &r;
    std::string where;
    tinygltf::Primitive &primitive;
    const tinygltf::Value &value; // value of the extension
    draco::Mesh mesh = {};
};

const tinygltf::Accessor &accessor_of(decoding &d, int index)
{
    if (index < 0 || size_t(index) >= d.r.model.accessors.size())
        fail(d.r, d.where, "accessor %d does not exist; there are %zu", index, d.r.model.accessors.size());
    return d.r.model.accessors[size_t(index)];
}

// Numbers of attributes in the compressed bytes, by name.
std::map<std::string, uint32_t> numbers_of(decoding &d)
{
    std::map<std::string, uint32_t> result;

    if (!d.value.Has("attributes") || !d.value.Get("attributes").IsObject())
        fail(d.r, d.where, "the extension names no attributes");
    const tinygltf::Value &attributes = d.value.Get("attributes");
    for (const std::string &name : attributes.Keys()) {
        if (d.primitive.attributes.count(name) == 0)
            fail(d.r, d.where, "the primitive has no attribute '%.40s', which is compressed", name.c_str());
        result[name] = uint32_t(index_of(attributes, name.c_str()));
    }
    if (result.count("POSITION") == 0)
        fail(d.r, d.where, "positions are not among the compressed attributes");
    return result;
}

int indices_of(const decoding &d)
{
    return d.value.Has("indices") ? index_of(d.value, "indices") : d.primitive.indices;
}

void decode(decoding &d, const std::map<std::string, uint32_t> &attributes)
{
    std::string reason;
    const size_t points = accessor_of(d, d.primitive.attributes.at("POSITION")).count;
    const size_t corners = accessor_of(d, indices_of(d)).count;
    size_t size = 0;
    const unsigned char *bytes = view_bytes(d.r, index_of(d.value, "bufferView"), size, d.where);

    for (const auto &entry : attributes)
        if (accessor_of(d, d.primitive.attributes.at(entry.first)).count != points)
            fail(d.r, d.where, "the compressed attributes have different counts");
    if (points > UINT32_MAX / 3 || corners > UINT32_MAX / 3 || corners % 3 != 0 || points > corners)
        fail(d.r, d.where, "%zu vertices of %zu corners are not allowed", points, corners);
    if (corners / 3 / triangles_per_byte_max > size)
        fail(d.r, d.where, "%zu triangles in %zu compressed bytes; at most %zu a byte are allowed", corners / 3,
             size, triangles_per_byte_max);
    // For each corner, the library also needs tables of opposite corners, of vertices and of visited elements.
    check_room(d.r, d.where, corners, 64);
    const uint64_t room = IMPORT_BYTES_MAX - d.r.scene->blob_bytes;
    const limits wanted = {uint32_t(corners / 3), uint32_t(points), room, &reason};
    draco::DecoderBuffer buffer;
    draco::DracoHeader header = {};
    buffer.Init(reinterpret_cast<const char *>(bytes), size);
    draco::DecoderBuffer ahead = buffer;
    if (!draco::PointCloudDecoder::DecodeHeader(&ahead, &header).ok() ||
        header.encoder_type != draco::TRIANGULAR_MESH)
        fail(d.r, d.where, "the %zu compressed bytes are no mesh of Draco", size);
    std::unique_ptr<draco::MeshDecoder> decoder;
    if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING)
        decoder = std::make_unique<bounded<draco::MeshEdgebreakerDecoder>>(wanted);
    else
        decoder = std::make_unique<bounded<draco::MeshSequentialDecoder>>(wanted);
    const draco::Status status = decoder->Decode(draco::DecoderOptions(), &buffer, &d.mesh);
    if (!status.ok())
        fail(d.r, d.where, "the mesh cannot be decoded by Draco: %.200s",
             reason.empty() ? status.error_msg() : reason.c_str());
    if (d.mesh.num_faces() * 3 != corners || d.mesh.num_points() != points)
        fail(d.r, d.where, "%u triangles of %u vertices were decoded, where the accessors have %zu of %zu",
             d.mesh.num_faces(), d.mesh.num_points(), corners / 3, points);
}

// Adds an accessor like the one at `index` for these bytes.
int add_accessor(decoding &d, int index, std::vector<unsigned char> bytes)
{
    tinygltf::Model &model = d.r.model;
    tinygltf::Accessor accessor = model.accessors[size_t(index)];
    tinygltf::BufferView view;
    tinygltf::Buffer buffer;

    view.buffer = int(model.buffers.size());
    view.byteLength = bytes.size();
    buffer.data = std::move(bytes);
    accessor.bufferView = int(model.bufferViews.size());
    accessor.byteOffset = 0;
    accessor.sparse.isSparse = false;
    model.buffers.push_back(std::move(buffer));
    model.bufferViews.push_back(std::move(view));
    model.accessors.push_back(std::move(accessor));
    return int(model.accessors.size() - 1);
}

template <typename type>
std::vector<unsigned char> values_of(decoding &d, const draco::PointAttribute &attribute, const std::string &name)
{
    const size_t points = d.mesh.num_points();
    const int8_t components = int8_t(attribute.num_components());
    const size_t element_bytes = size_t(components) * sizeof(type);

    check_room(d.r, d.where, points, element_bytes);
    std::vector<unsigned char> bytes(points * element_bytes);
    type value[components_max];
    for (uint32_t i = 0; i < points; i++) {
        const draco::AttributeValueIndex at = attribute.mapped_index(draco::PointIndex(i));
        if (at.value() >= attribute.size() || !attribute.ConvertValue(at, components, value))
            fail(d.r, d.where, "vertex %u of %.40s was not decoded", i, name.c_str());
        memcpy(bytes.data() + i * element_bytes, value, element_bytes);
    }
    return bytes;
}

std::vector<unsigned char> attribute_bytes(decoding &d, int component_type, const draco::PointAttribute &attribute,
                                           const std::string &name)
{
    switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
        return values_of<int8_t>(d, attribute, name);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return values_of<uint8_t>(d, attribute, name);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
        return values_of<int16_t>(d, attribute, name);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return values_of<uint16_t>(d, attribute, name);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return values_of<uint32_t>(d, attribute, name);
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
        return values_of<float>(d, attribute, name);
    default:
        fail(d.r, d.where, "%.40s has component type %d, which is not allowed", name.c_str(), component_type);
    }
}

// Replaces an attribute; values get the type of the accessor, which may differ from the compressed one.
void replace_attribute(decoding &d, const std::string &name, uint32_t number)
{
    const int index = d.primitive.attributes.at(name);
    const tinygltf::Accessor &accessor = accessor_of(d, index);
    const draco::PointAttribute *attribute = d.mesh.GetAttributeByUniqueId(number);

    if (!attribute)
        fail(d.r, d.where, "the compressed bytes have no attribute %u, which is to be %.40s", number,
             name.c_str());
    if (attribute->num_components() != tinygltf::GetNumComponentsInType(uint32_t(accessor.type)))
        fail(d.r, d.where, "%.40s has %d components when decoded, which its accessor has not", name.c_str(),
             int(attribute->num_components()));
    d.primitive.attributes[name] =
        add_accessor(d, index, attribute_bytes(d, accessor.componentType, *attribute, name));
}

void replace_indices(decoding &d)
{
    std::vector<unsigned char> bytes(size_t(d.mesh.num_faces()) * 12);

    for (uint32_t i = 0; i < d.mesh.num_faces(); i++) {
        const draco::Mesh::Face &face = d.mesh.face(draco::FaceIndex(i));
        const uint32_t corners[3] = {face[0].value(), face[1].value(), face[2].value()};
        memcpy(bytes.data() + size_t(i) * 12, corners, 12);
    }
    d.primitive.indices = add_accessor(d, indices_of(d), std::move(bytes));
    tinygltf::Accessor &accessor = d.r.model.accessors.back();
    accessor.type = TINYGLTF_TYPE_SCALAR;
    accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    d.primitive.mode = TINYGLTF_MODE_TRIANGLES; // Draco has nothing but triangles
}
} // namespace

void decode_draco(reader &r, size_t mesh)
{
    std::vector<tinygltf::Primitive> &primitives = r.model.meshes[mesh].primitives;

    r.draco_buffers = r.model.buffers.size();
    for (size_t i = 0; i < primitives.size(); i++) {
        const tinygltf::Value *value = extension(primitives[i].extensions, "KHR_draco_mesh_compression");
        if (!value)
            continue;
        decoding d = {r, place("meshes", mesh) + "." + place("primitives", i), primitives[i], *value};
        const std::map<std::string, uint32_t> attributes = numbers_of(d);
        decode(d, attributes);
        for (const auto &entry : attributes)
            replace_attribute(d, entry.first, entry.second);
        replace_indices(d);
    }
}

void forget_draco(reader &r)
{
    for (size_t i = r.draco_buffers; i < r.model.buffers.size(); i++)
        r.model.buffers[i].data = {};
}
} // namespace gltf
