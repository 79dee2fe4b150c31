// SPDX-License-Identifier: MIT
// The module that links Assimp. It passes the bytes of the model, and no other file, to the library, and contains
// its exceptions.
#include "library.h"

#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <string>

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define LEAKS_ARE_SOUGHT
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(LEAKS_ARE_SOUGHT)
#include <sanitizer/lsan_interface.h>
#endif

namespace
{
class model_stream : public Assimp::IOStream
{
  public:
    model_stream(const unsigned char *from, size_t count) : bytes(from), size_bytes(count)
    {
    }
    size_t Read(void *to, size_t size, size_t count) override
    {
        const size_t whole = size == 0 ? 0 : std::min(count, (size_bytes - at) / size);
        if (whole > 0)
            memcpy(to, bytes + at, whole * size);
        at += whole * size;
        return whole;
    }
    size_t Write(const void *, size_t, size_t) override
    {
        return 0;
    }
    aiReturn Seek(size_t offset, aiOrigin origin) override
    {
        // Offsets from the current position and the end may be negative, as with fseek().
        const size_t from = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? at : size_bytes;
        if (from + offset > size_bytes)
            return aiReturn_FAILURE;
        at = from + offset;
        return aiReturn_SUCCESS;
    }
    size_t Tell() const override
    {
        return at;
    }
    size_t FileSize() const override
    {
        return size_bytes;
    }
    void Flush() override
    {
    }

  private:
    const unsigned char *bytes;
    size_t size_bytes, at = 0;
};

class model_system : public Assimp::IOSystem
{
  public:
    model_system(std::string of, const unsigned char *from, size_t count)
        : name(std::move(of)), bytes(from), size_bytes(count)
    {
    }
    bool Exists(const char *path) const override
    {
        return name == path;
    }
    char getOsSeparator() const override
    {
        return '/';
    }
    Assimp::IOStream *Open(const char *path, const char *mode) override
    {
        return name == path && mode[0] == 'r' ? new model_stream(bytes, size_bytes) : nullptr;
    }
    void Close(Assimp::IOStream *stream) override
    {
        delete stream;
    }

  private:
    const std::string name;
    const unsigned char *bytes;
    size_t size_bytes;
};

// Frees a reader after a fault only in fuzzers, which live for many models: destroying it may crash, and this
// process lives for one model only.
struct abandon {
    void operator()(Assimp::Importer *importer) const
    {
#if defined(__SANITIZE_ADDRESS__) || defined(LEAKS_ARE_SOUGHT)
        delete importer;
#else
        static_cast<void>(importer);
#endif
    }
};

// Some readers of the library do not check a face's corners, and its next steps read and write at them.
bool has_all_corners(const aiScene &scene, char reason[ASSIMP_REASON_BYTES])
{
    for (unsigned i = 0; i < scene.mNumMeshes; i++) {
        const aiMesh &mesh = *scene.mMeshes[i];
        for (unsigned f = 0; f < mesh.mNumFaces; f++)
            for (unsigned k = 0; k < mesh.mFaces[f].mNumIndices; k++)
                if (mesh.mFaces[f].mIndices[k] >= mesh.mNumVertices) {
                    snprintf(reason, ASSIMP_REASON_BYTES, "a face has the vertex %u, but there are %u",
                             mesh.mFaces[f].mIndices[k], mesh.mNumVertices);
                    return false;
                }
    }
    return true;
}

bool has_colours(const aiScene &scene)
{
    return std::any_of(scene.mMeshes, scene.mMeshes + scene.mNumMeshes,
                       [](const aiMesh *mesh) { return mesh->mColors[0] != nullptr; });
}

const aiScene *read(const char *name, const assimp_format *format, const unsigned char *bytes, size_t size_bytes,
                    void **keep, char reason[ASSIMP_REASON_BYTES])
{
    const char *dot = strrchr(name, '.');
    // No path: the library must not see a folder
    const std::string plain = std::string("model") + (dot ? dot : "");
    unsigned steps = aiProcess_JoinIdenticalVertices;
    std::unique_ptr<Assimp::Importer, abandon> importer(new Assimp::Importer);

    importer->SetIOHandler(new model_system(plain, bytes, size_bytes)); // owned by the importer
    importer->SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
    if (format->has_facets) {
        importer->SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, aiComponent_NORMALS);
        steps |= aiProcess_RemoveComponent;
    }
    const aiScene *scene = importer->ReadFile(plain.c_str(), 0);
    if (scene && !has_all_corners(*scene, reason))
        return nullptr;
    // Joining ignores colours: faces would lose theirs to their neighbours.
    if (scene && has_colours(*scene))
        steps &= ~unsigned(aiProcess_JoinIdenticalVertices);
    if (scene && steps != 0)
        scene = importer->ApplyPostProcessing(steps);
    snprintf(reason, ASSIMP_REASON_BYTES, "%s", scene ? "" : importer->GetErrorString());
    if (scene)
        *keep = importer.release();
    return scene;
}

const aiScene *read_guarded(const char *name, const assimp_format *format, const unsigned char *bytes,
                            size_t size_bytes, void **keep, char reason[ASSIMP_REASON_BYTES])
{
#if defined(__SANITIZE_ADDRESS__) || defined(LEAKS_ARE_SOUGHT)
    const __lsan::ScopedDisabler
        disabled; // the library leaks for broken files; the importer lives for one model only
#endif
    *keep = nullptr;
    try {
        return read(name, format, bytes, size_bytes, keep, reason);
    } catch (const std::exception &exception) {
        snprintf(reason, ASSIMP_REASON_BYTES, "%s", exception.what());
    } catch (...) {
        snprintf(reason, ASSIMP_REASON_BYTES, "unknown fault");
    }
    return nullptr;
}

void release(void *keep)
{
    delete static_cast<Assimp::Importer *>(keep);
}
} // namespace

const struct assimp_library assimp_library = {read_guarded, release};
