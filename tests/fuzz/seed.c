/* SPDX-License-Identifier: MIT */
/* Writes what the fuzzers start from: seed FOLDER makes FOLDER/protocol.dict out of the table, and valid inputs in
 * FOLDER/codec, FOLDER/framing, FOLDER/handshake and FOLDER/sealed, noise in FOLDER/scene, sessions in
 * FOLDER/session, frames in FOLDER/frame, models in FOLDER/assimp, FOLDER/gltf, FOLDER/obj and
 * FOLDER/nff. */
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "protocol/handshake.h"
#include "tests/fuzz/recorded_session.h"
#include "tests/fuzz/sealed_random.h"
#include "tests/fuzz/seed_frames.h"
#include "tests/unit/protocol/cases.h"

static struct case_maker maker;
static struct plain_bytes plain;

static bool make_folder(const char *path)
{
    if (mkdir(path, 0777) != 0 && errno != EEXIST) {
        perror(path);
        return false;
    }
    return true;
}

bool seed_write_file(const char *folder, const char *what, const char *name, int number, const void *bytes,
                     size_t count)
{
    char path[4096];
    snprintf(path, sizeof(path), "%s/%s", folder, what);
    if (!make_folder(path)) {
        return false;
    }
    snprintf(path, sizeof(path), "%s/%s/%s-%d", folder, what, name, number);
    FILE *file = fopen(path, "wb");
    bool ok = file && fwrite(bytes, 1, count, file) == count;
    ok = (!file || fclose(file) == 0) && ok;
    if (!ok) {
        perror(path);
    }
    return ok;
}

static void word(FILE *file, uint64_t value, size_t bytes)
{
    fputc('"', file);
    for (size_t i = 0; i < bytes; i++) {
        fprintf(file, "\\x%02x", (unsigned)(value >> (8 * i)) & 0xff);
    }
    fputs("\"\n", file);
}

static void words_of_struct(FILE *file, const struct struct_desc *desc)
{
    for (const struct field_desc *field = desc->fields; field->name; field++) {
        uint32_t minimum, maximum;
        switch (field->kind) {
        case FIELD_INT:
            word(file, field->min, field->width_bytes);
            word(file, field->max, field->width_bytes);
            break;
        case FIELD_ENUM:
            word(file, field->enumeration->values[field->enumeration->value_count - 1].number, 4);
            break;
        case FIELD_REAL:
            memcpy(&minimum, &field->real_min, 4);
            memcpy(&maximum, &field->real_max, 4);
            word(file, minimum, 4);
            word(file, maximum, 4);
            break;
        case FIELD_STRING:
        case FIELD_ARRAY:
        case FIELD_BULK:
            word(file, field->max, 4);
            break;
        case FIELD_BYTES:
        case FIELD_RECORD:
            break;
        }
    }
    word(file, desc->wire_fixed_bytes, 2);
}

static bool write_dictionary(const char *folder)
{
    char path[4096];
    snprintf(path, sizeof(path), "%s/protocol.dict", folder);
    FILE *file = fopen(path, "w");
    if (!file) {
        perror(path);
        return false;
    }
    fputs("\"FARL\"\n\"\\x00\\x00\\xc0\\x7f\"\n\"\\x00\\x00\\x80\\x7f\"\n\"\\xed\\xa0\\x80\"\n", file);
    for (size_t i = 0; i < protocol_record_count; i++) {
        words_of_struct(file, protocol_records[i]());
    }
    for (size_t i = 0; i < protocol_message_count; i++) {
        fprintf(file, "# %s\n", protocol_messages[i].info.name);
        word(file, protocol_messages[i].info.type, 2);
        words_of_struct(file, protocol_messages[i].body());
    }
    return fclose(file) == 0;
}

static bool write_messages(const char *folder)
{
    static uint8_t framed[FRAMING_MESSAGE_MAX_BYTES + 2];
    struct message message;
    struct writer writer;
    for (size_t i = 0; i < protocol_message_count; i++) {
        const char *name = protocol_messages[i].info.name;
        for (enum case_mode mode = CASE_MIN; mode < CASE_MODE_COUNT; mode++) {
            case_make(&maker, &message, &protocol_messages[i], mode, 21);
            plain_encode(&plain, &message);
            uint8_t *input = malloc(plain.count + 2);
            if (!input) {
                return false;
            }
            input[0] = (uint8_t)i;
            input[1] = (uint8_t)(i >> 8);
            memcpy(input + 2, plain.data, plain.count);
            bool ok = seed_write_file(folder, "codec", name, (int)mode, input, plain.count + 2);
            free(input);
            writer_init(&writer, framed, sizeof(framed));
            writer_put_u8(&writer, 7);
            writer_put_u8(&writer, 12);
            if (!message_write(&writer, 1, 2, &message)) {
                fprintf(stderr, "%s: %s\n", writer.error.field, writer.error.text);
                return false;
            }
            if (!ok || !seed_write_file(folder, "framing", name, (int)mode, framed, writer.used_bytes)) {
                return false;
            }
        }
    }
    return true;
}

static bool write_handshakes(const char *folder)
{
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    struct handshake_hello hello = {.version_min = 1, .version_max = HANDSHAKE_VERSION_MAX, .name = "a client"};
    struct handshake_reply reply = {.version = HANDSHAKE_VERSION_MAX, .name = "farlightd"};
    struct handshake_reply refusal = {.version = 0, .name = "farlightd", .text = "none in common"};
    return seed_write_file(folder, "handshake", "hello", 0, bytes, handshake_hello_encode(bytes, &hello)) &&
           seed_write_file(folder, "handshake", "reply", 0, bytes, handshake_reply_encode(bytes, &reply)) &&
           seed_write_file(folder, "handshake", "reply", 1, bytes, handshake_reply_encode(bytes, &refusal));
}

/* ---- sealed ---- */

struct said {
    uint8_t bytes[4096]; /* the first says who hears it, and in which pieces */
    size_t count;
};

/* Passes the output of one end to the other, and keeps it. */
static bool pass(struct sealed_link *from, struct sealed_link *to, unsigned hearing_end, struct said *said)
{
    struct decode_error error;
    size_t bytes, room;
    const uint8_t *waiting = sealed_link_waiting(from, &bytes);
    uint8_t *space = sealed_link_space(to, &room);
    if (bytes == 0 || bytes > room || bytes > sizeof(said->bytes) - said->count) {
        return bytes == 0;
    }
    memcpy(space, waiting, bytes);
    memcpy(said->bytes + said->count, waiting, bytes);
    said->count += bytes;
    sealed_link_sent(from, bytes);
    sealed_link_came(to, bytes);
    sealed_random_end = hearing_end;
    return sealed_link_handshake(to, &error) != SEALED_FATAL;
}

static bool write_sealed(const char *folder)
{
    struct said up = {.bytes = {0xff}, .count = 1}, down = {.bytes = {0xfe}, .count = 1};
    randombytes_set_implementation(&sealed_random);
    sealed_random_begin();
    sealed_random_end = 0;
    struct sealed_link *client = sealed_link_client(&sealed_fuzz_key);
    struct sealed_link *server = sealed_link_server(&sealed_fuzz_key, 1);
    bool ok = client && server;
    for (int round = 0; ok && round < 3; round++) {
        ok = pass(client, server, 1, &up) && pass(server, client, 0, &down);
    }
    ok = ok && sealed_link_seal(client, maker.memory, 300) == 300 &&
         sealed_link_seal(server, maker.memory, 300) == 300 && sealed_link_seal_last(client) &&
         sealed_link_seal_last(server) && pass(client, server, 1, &up) && pass(server, client, 0, &down);
    sealed_link_destroy(client);
    sealed_link_destroy(server);
    return ok && seed_write_file(folder, "sealed", "up", 0, up.bytes, up.count) &&
           seed_write_file(folder, "sealed", "down", 0, down.bytes, down.count);
}

/* Bytes that a generator makes, for fuzzers that read any as something. */
static bool write_noise(const char *folder)
{
    uint32_t state = 1;
    for (int number = 0; number < 16; number++) {
        uint8_t bytes[1024];
        for (size_t i = 0; i < sizeof(bytes); i++) {
            state = state * 1664525u + 1013904223u; /* Numerical Recipes */
            bytes[i] = (uint8_t)(state >> 24);
        }
        if (!seed_write_file(folder, "scene", "noise", number, bytes, sizeof(bytes))) {
            return false;
        }
    }
    return true;
}

/* ---- sessions: as fuzz_session.c has its steps ---- */

#define STEP_MESSAGE 1
#define STEP_TIME 2
#define STEP_CIRCUMSTANCE 3
#define STEP_SETTLE 16
#define CONNECT 16
#define HELLO 17
#define STOP 19
#define ONLY_LOOKS 20
#define FRAME_MS_ROOT 12

struct session_seed {
    uint8_t bytes[16384];
    struct writer writer;
    unsigned client, settle;
    bool takes_time; /* with a pause behind each message */
};

static unsigned number_of(uint16_t type)
{
    unsigned number = 0;
    for (size_t i = 0; protocol_messages[i].info.type != type; i++) {
        number += (protocol_messages[i].info.from & MESSAGE_FROM_CLIENT) != 0;
    }
    return number;
}

static void put_step(struct session_seed *seed, unsigned kind)
{
    writer_put_u8(&seed->writer, (uint8_t)(kind | seed->client << 2 | seed->settle));
}

static void put_circumstance(struct session_seed *seed, unsigned what)
{
    put_step(seed, STEP_CIRCUMSTANCE);
    writer_put_u8(&seed->writer, (uint8_t)what);
}

static void put_message(void *context, uint32_t request, uint32_t channel, const struct message *message)
{
    struct session_seed *seed = context;
    put_step(seed, STEP_MESSAGE);
    writer_put_u8(&seed->writer, (uint8_t)number_of((uint16_t)message->type));
    writer_put_u8(&seed->writer, (uint8_t)request);
    writer_put_u8(&seed->writer, (uint8_t)channel);
    /* By way of its own buffer: bulk data are aligned from the start of the payload. */
    static uint8_t payload[8192];
    struct writer of_payload;
    writer_init(&of_payload, payload, sizeof(payload));
    if (!message_encode(&of_payload, message)) {
        fprintf(stderr, "%s: %s\n", of_payload.error.field, of_payload.error.text);
        exit(1);
    }
    writer_put_u16(&seed->writer, (uint16_t)of_payload.used_bytes);
    writer_put_bytes(&seed->writer, payload, of_payload.used_bytes);
    if (seed->takes_time) {
        put_step(seed, STEP_TIME);
        writer_put_u8(&seed->writer, FRAME_MS_ROOT);
    }
}

/* Stays, with its scene. */
static void put_message_but_the_last(void *context, uint32_t request, uint32_t channel,
                                     const struct message *message)
{
    if (message->type != MESSAGE_SCENE_CLOSE && message->type != MESSAGE_GOODBYE) {
        put_message(context, request, channel, message);
    }
}

static void come(struct session_seed *seed, unsigned client)
{
    seed->client = client;
    put_circumstance(seed, CONNECT);
    put_circumstance(seed, HELLO);
}

static bool write_session(const char *folder, int number, unsigned settle, unsigned circumstance,
                          void session(recorded_say_fn *say, void *context))
{
    static struct session_seed seed;
    seed = (struct session_seed){.settle = settle, .takes_time = settle && circumstance == 0};
    writer_init(&seed.writer, seed.bytes, sizeof(seed.bytes));
    if (session == recorded_onlooker) {
        come(&seed, 1);
        recorded_session(put_message_but_the_last, &seed);
    }
    come(&seed, 0);
    put_circumstance(&seed, circumstance);
    session(put_message, &seed);
    put_circumstance(&seed, STOP);
    return seed_write_file(folder, "session", "session", number, seed.bytes, seed.writer.used_bytes);
}

static bool write_sessions(const char *folder)
{
    bool ok = true;
    int number = 0;
    static const unsigned circumstances[] = {0, 1, 2, 4, 8, ONLY_LOOKS};
    for (unsigned settle = 0; settle <= STEP_SETTLE; settle += STEP_SETTLE) {
        for (size_t i = 0; i < sizeof(circumstances) / sizeof(circumstances[0]); i++) {
            ok = ok && write_session(folder, number++, settle, circumstances[i], recorded_session) &&
                 write_session(folder, number++, settle, circumstances[i], recorded_onlooker) &&
                 write_session(folder, number++, settle, circumstances[i], recorded_blunders);
        }
    }
    return ok;
}

/* ---- models ---- */

/* A triangle, moved; its buffer is the three corners and their indices. */
#define GLTF_BUFFER "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA="
static const char gltf_model[] =
    "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0,1]}],"
    "\"extensionsUsed\":[\"KHR_lights_punctual\",\"KHR_materials_transmission\"],"
    "\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"spot\",\"spot\":{\"outerConeAngle\":1}}]}},"
    "\"nodes\":[{\"mesh\":0,\"skin\":0,\"rotation\":[0,0,0,1],\"scale\":[1,2,1],\"children\":[2]},"
    "{\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}},{\"camera\":0}],"
    "\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":1,\"znear\":0.1}}],"
    "\"skins\":[{\"joints\":[1,2]}],\"textures\":[{\"source\":0,\"sampler\":0}],\"samplers\":[{\"wrapS\":33648}],"
    "\"images\":[{\"uri\":\"missing.png\"}],"
    "\"materials\":[{\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,0,0,1],"
    "\"baseColorTexture\":{\"index\":0}},\"extensions\":{\"KHR_materials_transmission\":{\"transmissionFactor\":1}"
    "}}],"
    "\"meshes\":[{\"weights\":[0.5],\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1,\"material\":0,"
    "\"targets\":[{\"POSITION\":0}]}]}],"
    "\"animations\":[{\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,\"path\":\"translation\"}}],"
    "\"samplers\":[{\"input\":2,\"output\":0,\"interpolation\":\"STEP\"}]}],"
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
    "{\"bufferView\":1,\"componentType\":5123,\"count\":3,\"type\":\"SCALAR\"},"
    "{\"componentType\":5126,\"count\":3,\"type\":\"SCALAR\",\"sparse\":{\"count\":2,\"indices\":{\"bufferView\":"
    "1,"
    "\"byteOffset\":2,\"componentType\":5123},\"values\":{\"bufferView\":0,\"byteOffset\":12}}}],"
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,\"byteLength\":6}],"
    "\"buffers\":[{\"byteLength\":44,\"uri\":\"data:application/octet-stream;base64," GLTF_BUFFER "\"}]}";
static const char obj_model[] =
    "mtllib a b.mtl\no thing\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\n"
    "vn 0 0 1\nusemtl red\ns 1\nf 1/1/1 2/2/1 \\\n3//1 -1\ng other\nl 1 2\np 3\nf 1 2 3\n";
/* The first letter chooses the format, by its place in the table (import/assimp/library.c). */
static const char *const assimp_models[] = {
    "mply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uch"
    "ar red\nproperty uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int vertex_indices\ne"
    "nd_header\n0 0 0 255 0 0\n1 0 0 0 255 0\n1 1 0 0 0 255\n0 1 0 255 255 255\n4 0 1 2 3\n",
    "mply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uch"
    "ar red\nproperty uchar green\nproperty uchar blue\nend_header\n0 0 0 255 0 0\n1 0 0 0 255 0\n1 1 0 0 0 255\n"
    "0 1 0 255 255 255\n",
    "nsolid thing\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\ne"
    "ndsolid thing\n",
    "lOFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n",
    "iAC3Db\nMATERIAL \"red\" rgb 1 0 0  amb 0.2 0.2 0.2  emis 0 0 0  spec 0.5 0.5 0.5  shi 10  trans 0\nOBJECT w"
    "orld\nkids 1\nOBJECT poly\nname \"quad\"\nloc 0 2 0\nnumvert 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\nnumsurf 1\nSURF "
    "0x20\nmat 0\nrefs 4\n0 0 0\n1 1 0\n2 1 1\n3 0 1\nkids 0\n",
    "o<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<X3D profile=\"Interchange\" version=\"3.3\"><Scene><Transform "
    "translation=\"0 2 0\"><Shape><Appearance><Material diffuseColor=\"1 0 0\"/></Appearance>\n<IndexedFaceSet co"
    "ordIndex=\"0 1 2 3 -1\" solid=\"false\"><Coordinate point=\"0 0 0 1 0 0 1 1 0 0 1 0\"/></IndexedFaceSet></Sh"
    "ape></Transform></Scene></X3D>\n",
    "j<?xml version=\"1.0\"?>\n<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">"
    "<asset><unit meter=\"0.01\" name=\"centimeter\"/><up_axis>Z_UP</up_axis></asset>\n<library_cameras><camera i"
    "d=\"cam\"><optics><technique_common><perspective><xfov>60</xfov><aspect_ratio>1.5</aspect_ratio><znear>1</zn"
    "ear><zfar>1000</zfar></perspective></technique_common></optics></camera></library_cameras>\n<library_lights>"
    "<light id=\"sun\"><technique_common><directional><color>1 0.5 0.25</color></directional></technique_common><"
    "/light></library_lights>\n<library_effects><effect id=\"e\"><profile_COMMON><technique sid=\"c\"><phong><dif"
    "fuse><color>1 0 0 1</color></diffuse><shininess><float>16</float></shininess></phong></technique></profile_C"
    "OMMON></effect></library_effects>\n<library_materials><material id=\"m\" name=\"red\"><instance_effect url="
    "\"#e\"/></material></library_materials>\n<library_geometries><geometry id=\"g\"><mesh><source id=\"p\"><floa"
    "t_array id=\"pa\" count=\"12\">0 0 0 100 0 0 100 0 100 0 0 100</float_array><technique_common><accessor sour"
    "ce=\"#pa\" count=\"4\" stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/><par"
    "am name=\"Z\" type=\"float\"/></accessor></technique_common></source>\n<vertices id=\"v\"><input semantic=\""
    "POSITION\" source=\"#p\"/></vertices><polylist material=\"s\" count=\"1\"><input semantic=\"VERTEX\" source="
    "\"#v\" offset=\"0\"/><vcount>4</vcount><p>0 1 2 3</p></polylist></mesh></geometry></library_geometries>\n<li"
    "brary_visual_scenes><visual_scene id=\"s\"><node id=\"quad\" name=\"quad\"><translate>0 0 200</translate><in"
    "stance_geometry url=\"#g\"><bind_material><technique_common><instance_material symbol=\"s\" target=\"#m\"/><"
    "/technique_common></bind_material></instance_geometry></node><node id=\"eye\" name=\"eye\"><instance_camera "
    "url=\"#cam\"/></node><node id=\"lamp\" name=\"lamp\"><instance_light url=\"#sun\"/></node></visual_scene></l"
    "ibrary_visual_scenes>\n<scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>\n",
    "k; FBX 7.3.0 project file\nFBXHeaderExtension:  {\nFBXHeaderVersion: 1003\nFBXVersion: 7300\n}\nGlobalSettin"
    "gs:  {\nVersion: 1000\nProperties70:  {\nP: \"UpAxis\", \"int\", \"Integer\", \"\",2\nP: \"UpAxisSign\", \"i"
    "nt\", \"Integer\", \"\",1\nP: \"FrontAxis\", \"int\", \"Integer\", \"\",1\nP: \"FrontAxisSign\", \"int\", \""
    "Integer\", \"\",-1\nP: \"CoordAxis\", \"int\", \"Integer\", \"\",0\nP: \"CoordAxisSign\", \"int\", \"Integer"
    "\", \"\",1\nP: \"UnitScaleFactor\", \"double\", \"Number\", \"\",1\n}\n}\nDefinitions:  {\nVersion: 100\nCou"
    "nt: 2\n}\nObjects:  {\nGeometry: 10, \"Geometry::quad\", \"Mesh\" {\nVertices: *12 {\na: 0,0,0,100,0,0,100,0"
    ",100,0,0,100\n}\nPolygonVertexIndex: *4 {\na: 0,1,2,-4\n}\nGeometryVersion: 124\nLayerElementMaterial: 0 {\n"
    "Version: 101\nName: \"\"\nMappingInformationType: \"AllSame\"\nReferenceInformationType: \"IndexToDirect\"\n"
    "Materials: *1 {\na: 0\n}\n}\nLayer: 0 {\nVersion: 100\nLayerElement:  {\nType: \"LayerElementMaterial\"\nTyp"
    "edIndex: 0\n}\n}\n}\nModel: 20, \"Model::quad\", \"Mesh\" {\nVersion: 232\nProperties70:  {\nP: \"Lcl Transl"
    "ation\", \"Lcl Translation\", \"\", \"A\",0,0,200\n}\n}\nMaterial: 30, \"Material::red\", \"\" {\nVersion: 1"
    "02\nShadingModel: \"phong\"\nProperties70:  {\nP: \"DiffuseColor\", \"Color\", \"\", \"A\",1,0,0\n}\n}\n}\nC"
    "onnections:  {\nC: \"OO\",20,0\nC: \"OO\",10,20\nC: \"OO\",30,20\n}\n",
};
static const char nff_model[] =
    "v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 45\nhither 0.1\nresolution 8 8\nb 0.1 0.2 0.3\nl 1 2 3 1 1 1\n"
    "f 1 0.5 0.2 0.8 0.2 20 0.1 1.5\ns 0 0 0 1\nc 0 0 0 1 0 2 0 0.5\np 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
    "pp 3\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n";

static bool write_models(const char *folder)
{
    for (int i = 0; i < (int)(sizeof(assimp_models) / sizeof(assimp_models[0])); i++)
        if (!seed_write_file(folder, "assimp", "model", i, assimp_models[i], strlen(assimp_models[i])))
            return false;
    return seed_write_file(folder, "gltf", "model", 0, gltf_model, sizeof(gltf_model) - 1) &&
           seed_write_file(folder, "obj", "model", 0, obj_model, sizeof(obj_model) - 1) &&
           seed_write_file(folder, "nff", "model", 0, nff_model, sizeof(nff_model) - 1);
}

int main(int argument_count, char **arguments)
{
    if (argument_count != 2) {
        fprintf(stderr, "usage: %s FOLDER\n", arguments[0]);
        return 2;
    }
    bool ok = make_folder(arguments[1]) && write_dictionary(arguments[1]) && write_messages(arguments[1]) &&
              write_handshakes(arguments[1]) && write_sealed(arguments[1]) && write_noise(arguments[1]) &&
              write_sessions(arguments[1]) && seed_write_frames(arguments[1]) && write_models(arguments[1]);
    return ok ? 0 : 1;
}
