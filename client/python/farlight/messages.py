# SPDX-License-Identifier: MIT
"""Every message of the protocol. Written by generate.py from the tables of protocol/: change those instead.

Enumerations accept their words, too: Render(tracer="ldc").
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from . import fields as _f
from .fields import Bytes, Field, Message, Record, Word


class ErrorCode(Word):
    """what went wrong; stable numbers"""

    NONE = 0
    PROTOCOL = 1  # bytes that are no valid message; the connection is closed
    VERSION = 2  # no version in common
    INVALID = 3  # a field's value is not allowed
    UNKNOWN_ID = 4  # an identifier without an object
    UNSUPPORTED = 5  # known, but not in this build or on this device
    LIMIT = 6  # a limit of the configuration is reached
    BUSY = 7  # try again later
    CANCELLED = 8  # the client asked for it
    HASH_MISMATCH = 9  # a blob's bytes do not have the hash that names it
    OUT_OF_MEMORY = 10  # host or device memory
    DEVICE_LOST = 11  # the GPU context was lost and is being rebuilt
    INTERNAL = 12  # a fault of the daemon
    DENIED = 13  # the peer may not do this
    SHUTTING_DOWN = 14  # the daemon is about to stop
    TIMEOUT = 15  # the peer took too long
    CONFLICT = 16  # another client has changed it meanwhile


class Severity(Word):
    """of a note"""

    INFO = 0
    WARNING = 1  # a part of the model is not shown as its author meant it
    ERROR = 2  # the model cannot be used


class Brdf(Word):
    """model of rough reflection, for the integrator path"""

    GGX = 0  # the microfacets of glTF 2.0
    WARD = 1  # Ward's anisotropic model


class Background(Word):
    """what is seen where a picture shows no surface; what mirrors and glass show, and the light, are the
    environment's"""

    ENVIRONMENT = 0  # the environment
    TRANSPARENT = 1  # nothing: alpha is 0, or what a surface covers of the pixel
    COLOUR = 2  # one colour, which no exposure and no tone map changes


class Accumulation(Word):
    """whether a frame of a batch adds its samples to those of the frame before it, which may be the last one of the
    client's previous job with the scene"""

    OFF = 0  # each frame begins with no samples
    ON = 1  # one that shows the same (scene, clips, camera) adds its samples; a change starts over
    ANEW = 2  # likewise, but the job's first frame begins with none: the same job, the same picture


class Denoise(Word):
    """whether the noise of random choices is filtered out of the beauty: of the integrators distributed, path and ao,
    where it is rendered and not made from layers. Frames of a view that moves, and those at rest that do not have
    all their samples yet, also have what frames before them show of the same places"""

    OFF = 0  # it is not
    ON = 1  # it is, the less the less noise there is
    AUTO = 2


class Layer(Word):
    """a layer of a picture; in a set its number is the bit's. All but the beauty describe the first surface that a
    pixel's ray hits, opaque or not, with four numbers per pixel, 0 if there is none; the first sample is the
    picture's first also if frames are accumulated"""

    BEAUTY = 0  # the picture itself
    ALBEDO = 1  # base colour, mean of the samples; coverage
    NORMAL = 2
    DEPTH = 3
    POSITION = 4  # position of the first sample in world space, metres; 1 if there is a surface
    AO = 5
    ID = 6
    UNKNOWN = 7
    CRYPTO_OBJECT0 = 8
    CRYPTO_OBJECT1 = 9  # likewise, the third and the fourth
    CRYPTO_OBJECT2 = 10  # likewise, the fifth and the sixth
    CRYPTO_MATERIAL0 = 11  # likewise, of materials
    CRYPTO_MATERIAL1 = 12  # likewise
    CRYPTO_MATERIAL2 = 13  # likewise
    DIFFUSE_DIRECT = 16
    DIFFUSE_INDIRECT = 17  # the same, of light that other surfaces have sent there
    SPECULAR_DIRECT = 18
    SPECULAR_INDIRECT = 19  # the same, of light that other surfaces have sent there
    TRANSMISSION = 20  # light that comes through the first surface where that is glass
    EMISSION = 21  # light that the first surface sends out itself; also the colour of unlit ones
    BACKGROUND = 22


class Attachment(Word):
    """data of a frame besides its pixels; in a set its number is the bit's"""

    DEPTH = 0  # of the first surface, along the view
    NORMALS = 1  # of that surface, in world space
    STICKING = 2


class DepthForm(Word):
    """of attached depth"""

    METRES = 0  # f32 per pixel, metres; 0 if there is nothing
    INVERSE = 1


class FramePartKind(Word):
    """of a part of a frame: which of its bytes it has"""

    COLOURS = 0
    DEPTH = 1  # the encoded depth
    NORMALS = 2  # the encoded normals
    COARSE_DEPTH = 3
    STICKING = 4  # the encoded shares of what sticks


class Unit(Word):
    """unit of a row of a tracer's structure"""

    NUMBER = 0  # a number of things
    METRES = 1  # a length in world space
    BUILT = 2
    PER_RAY = 3  # a mean over the rays of this part
    PIXELS = 4  # a length in the picture


class Integrator(Word):
    """a light transport"""

    WHITTED = 0  # direct light, mirror reflection, refraction, sharp shadows
    DISTRIBUTED = 1
    RAYCAST = 2  # all surfaces along the ray, lit without shadows, blended front to back
    AO = 3  # ambient occlusion: the openness of each point
    PATH = 4  # all light that arrives over any number of bounces


class Primary(Word):
    """how the first hit of a pixel is found"""

    RASTER = 0  # rasterised visibility buffer
    TRACE = 1  # a wave of rays through the tracer
    AUTO = 2


class PixelFilter(Word):
    """distribution of samples about a pixel's centre; a single sample lies at it"""

    BLACKMAN_HARRIS = 0  # 1.5 pixels to each side
    GAUSSIAN = 1  # standard deviation half a pixel, cut off at 1.5 pixels
    TENT = 2  # 1 pixel to each side
    BOX = 3  # the pixel's own square


class RayKind(Word):
    """the purpose of a wave of rays"""

    PRIMARY = 0  # the first hit of a pixel
    SECONDARY = 1  # reflection, refraction and passing through a surface
    SHADOW = 2  # the transmittance towards a light


class ToneMap(Word):
    """from linear light to 8-bit sRGB"""

    NEUTRAL = 0  # Khronos PBR neutral
    ACES = 1  # Hill's fit of the ACES curve, as viewers of glTF have it
    NONE = 2  # clamp only


class PixelFormat(Word):
    """four channels, red first, rows from the top"""

    RGBA8 = 0  # tone-mapped sRGB, straight alpha
    RGBA16F = 1  # linear half floats, premultiplied alpha
    RGBA32F = 2  # linear floats, premultiplied alpha


class Encoding(Word):
    """encoding of the pixels of a frame"""

    RAW = 0  # unchanged
    ZSTD = 1  # Zstandard, lossless
    JPEG = 2  # JPEG; rgba8 only, alpha is dropped
    H264 = 3
    PREDICTED = 4


class JobKind(Word):
    """the kind of a job"""

    BATCH = 0  # every frame of a range, in order
    VIEW = 1  # the newest camera, until it is cancelled


class ViewSource(Word):
    """the origin of a picture of several views, of one through a lens, or of one between key frames"""

    RAYS = 0  # each of its rays is traced
    LAYERS = 1


class Sharing(Word):
    """the clients that may attach to a scene, and its lifetime"""

    PRIVATE = 0  # the client that opened it; it ends with the connection
    KEPT = 1
    SHARED = 2  # every client, by its name; it lingers as well


class Stage(Word):
    """the activity of a span of time"""

    APPLY = 0  # edits to the scene
    BUILD = 1  # acceleration structure
    UPLOAD = 2  # scene to the device
    PRIMARY = 3  # first hit of every pixel
    TRACE = 4  # one wave of rays through the tracer
    SHADE = 5  # hits of one wave to radiance and the next rays
    RESOLVE = 6  # samples to pixels, tone map
    READBACK = 7  # device to host
    ENCODE = 8  # pixels to bytes
    QUEUE = 9  # waiting, from encoded to the first byte sent
    SEND = 10  # from the first byte to the last handed to the kernel
    FRAME = 11  # everything, from its begin to its readback
    COMPARE = 12


class Clock(Word):
    """who measured"""

    CPU = 0  # monotonic clock of the daemon's host
    GPU = 1  # timer query


class NodeKind(Word):
    """the object of a node"""

    GROUP = 0  # nothing, only a transform
    MESH = 1
    SPHERES = 2
    LIGHT = 3
    CAMERA = 4


class ObjectKind(Word):
    """name spaces of identifiers"""

    NODE = 0
    MESH = 1
    SPHERES = 2
    MATERIAL = 3
    TEXTURE = 4
    LIGHT = 5
    CAMERA = 6
    DISC = 7
    SKIN = 8
    CLIP = 9
    CHANNEL = 10
    ENVIRONMENT = 11  # each scene has one, 1, which is not listed or removed; only for object_get


class ChannelPath(Word):
    """the property that a channel of a clip changes; in brackets the numbers per value"""

    NODE_TRANSLATION = 0  # (3) metres, in the parent's space
    NODE_ROTATION = 1  # (4) unit quaternion x y z w
    NODE_SCALE = 2  # (3)
    NODE_WEIGHTS = 3
    NODE_HIDDEN = 4  # (1) hidden from 0.5 on
    LIGHT_COLOUR = 16  # (3) as of set_light
    LIGHT_SIZE = 17  # (2) as of set_light
    MATERIAL_BASE_COLOUR = 32  # (4)
    MATERIAL_EMISSION = 33  # (3)
    MATERIAL_METALLIC = 34  # (1)
    MATERIAL_ROUGHNESS = 35  # (1)
    MATERIAL_TRANSMISSION = 36  # (1)
    MATERIAL_IOR = 37  # (1)
    VIEW_EYE = 48  # (3) position of the job's camera, world; for camera path keys
    VIEW_LOOK_AT = 49  # (3) likewise the point at the centre of its picture
    VIEW_UP = 50  # (3) likewise its upward direction
    VIEW_FOV_Y = 51  # (1) vertical field of view, radians
    VIEW_APERTURE = 52  # (1) as of render
    VIEW_FOCUS = 53  # (1) as of render
    VIEW_EXPOSURE = 54  # (1) stops, added to those of render


class Interpolation(Word):
    """between the keys of a channel; before the first and after the last it is constant"""

    STEP = 0  # the key before
    LINEAR = 1  # linear; rotations along the shorter arc (slerp)
    CUBIC_SPLINE = 2
    CATMULL_ROM = 3  # through the keys, the slope at one is that between its neighbours
    BEZIER = 4


class AlphaMode(Word):
    """effect of the base colour's alpha"""

    OPAQUE = 0
    MASK = 1  # below the cutoff there is no surface
    BLEND = 2  # the ray continues with the share that alpha lets through


class MaterialTexture(Word):
    """place of a texture among those of a material; which channels are read"""

    BASE_COLOUR = 0
    NORMAL = 1
    METALLIC_ROUGHNESS = 2  # blue: metallic; green: roughness
    OCCLUSION = 3  # red
    EMISSION = 4
    TRANSMISSION = 5  # red
    BUMP = 6  # red: height
    SPECULAR = 7  # alpha
    SPECULAR_COLOUR = 8
    CLEARCOAT = 9  # red
    CLEARCOAT_ROUGHNESS = 10  # green
    CLEARCOAT_NORMAL = 11
    SHEEN = 12
    SHEEN_ROUGHNESS = 13  # alpha
    IRIDESCENCE = 14  # red
    IRIDESCENCE_THICKNESS = 15  # green: of its film
    DIFFUSE_TRANSMISSION = 16  # alpha
    DIFFUSE_TRANSMISSION_COLOUR = 17
    ANISOTROPY = 18  # red and green: direction from the tangent, -1 to 1; blue: strength


class TextureFormat(Word):
    """texture format"""

    RGBA8_SRGB = 0  # colour; alpha is linear
    RGBA8_LINEAR = 1  # data


class Wrap(Word):
    """texture coordinates outside 0..1"""

    REPEAT = 0
    CLAMP = 1
    MIRROR = 2


class LightKind(Word):
    """light kind"""

    POINT = 0  # intensity in W/sr
    SPOT = 1  # intensity in W/sr, along -z of its node
    DIRECTIONAL = 2  # irradiance in W/m2, along -z of its node
    RECTANGLE = 3  # radiance in W/(m2 sr), in the node's xy plane, shining along -z
    SPHERE = 4  # radiance in W/(m2 sr)
    STEADY = 5


class CameraPath(Word):
    """motion of a job's camera"""

    AUTO = 0
    NODE = 1  # the scene's camera at `camera_node`, moving with it
    KEYS = 2  # keys; one: fixed; several: Catmull-Rom through them, over time
    ORBIT = 3  # starts as `keys[0]`, or as auto without a key, and turns about look_at


class ComparisonLayout(Word):
    """layout of the picture of a comparison"""

    HEAT = 0  # the errors, as colours
    SIDE = 1  # both pictures and the errors, side by side


class ComparisonSpace(Word):
    """of the values that were compared"""

    LINEAR = 0  # linear light as both files hold it; 1 is white
    SRGB = 1


class Tracer(Word):
    """an acceleration structure"""

    BVH = 0  # stackless bounding volume hierarchy
    NAIVE = 1  # every primitive for every ray; for tests
    REFERENCE = 2  # Embree on the CPU: the ground truth for the others
    LDC = 3  # layered depth cubes: surfaces sampled along three axes
    ABUFFER = 4  # a voxel grid and, along three axes, lists of all surfaces behind each texel
    RAYSPACE = 5  # a hierarchy over the rays of each wave, which descends the scene
    QUADTREE = 6  # quadtrees over the surfaces that a view sees, nearest first


class TracerForm(Word):
    """whose form of a tracer's algorithm answers"""

    FAST = 0  # ours
    PAPER = 1  # the paper's own, as near as it can be, to be compared with: slower


class RayspaceMode(Word):
    """what descends beside the hierarchy over the rays"""

    JOINT = 0  # the trees over the scene that are kept: the fastest
    FLAT = 1


class QuadtreeFaces(Word):
    """which surfaces the tracer quadtree knows"""

    CUBE = 0  # those seen from the eye all around, on the faces of a cube
    VIEW = 1  # those that the picture shows, with a margin round it


class QuadtreeHits(Word):
    """what a ray of the tracer quadtree hits"""

    AUTO = 0
    PRIMITIVE = 1  # the surface itself that a texel shows: exact distances
    PLANE = 2  # the plane that stands for it in the tree, as in the paper


@dataclass
class BlobRef(Record):
    """names a blob: BLAKE2b-256 over the BLAKE2b-256 hashes of its 1 MiB chunks; 0 bytes: none

    size_bytes: bytes
    hash: content hash
    """
    NAME: ClassVar[str] = "blob_ref"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("size_bytes", "Q", 0, 17179869184),
        _f.exactly("hash", 32),
    )
    size_bytes: int = 0
    hash: bytes = bytes(32)


@dataclass
class BlobIndex(Record):
    """one of the offered blobs

    index: position in the offer
    """
    NAME: ClassVar[str] = "blob_index"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("index", "I", 0, 1023),
    )
    index: int = 0


@dataclass
class MaterialRange(Record):
    """consecutive primitives that share a material

    first: first triangle or sphere
    count: number of triangles or spheres
    material: material, 0: the default one
    """
    NAME: ClassVar[str] = "material_range"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("first", "I", 0, 4294967295),
        _f.whole("count", "I", 0, 4294967295),
        _f.whole("material", "I", 0, 4294967295),
    )
    first: int = 0
    count: int = 0
    material: int = 0


@dataclass
class TextureUse(Record):
    """a texture as one input of a material

    texture: 0: none
    texcoord_set: which set of coordinates
    uv_transform: rows (a b c), (d e f): u' = a u + b v + c, v' = d u + e v + f
    strength: normal: scale; occlusion: strength; bump: height in metres; else unused
    """
    NAME: ClassVar[str] = "texture_use"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("texture", "I", 0, 4294967295),
        _f.whole("texcoord_set", "I", 0, 1),
        _f.real("uv_transform", -1e9, 1e9, 6),
        _f.real("strength", -1e6, 1e6),
    )
    texture: int = 0
    texcoord_set: int = 0
    uv_transform: Sequence[float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    strength: float = 0.0


@dataclass
class CameraKey(Record):
    """a camera at one time

    time_s: seconds
    eye_world: position
    look_at_world: the point at the centre of the picture
    up_world: not parallel to the view direction
    fov_y: vertical field of view
    """
    NAME: ClassVar[str] = "camera_key"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.real("time_s", 0.0, 1e6),
        _f.real("eye_world", -1e12, 1e12, 3),
        _f.real("look_at_world", -1e12, 1e12, 3),
        _f.real("up_world", -1e6, 1e6, 3),
        _f.real("fov_y", 0.001, 3.1),
    )
    time_s: float = 0.0
    eye_world: Sequence[float] = (0.0, 0.0, 0.0)
    look_at_world: Sequence[float] = (0.0, 0.0, 0.0)
    up_world: Sequence[float] = (0.0, 0.0, 0.0)
    fov_y: float = 0.001


@dataclass
class MorphWeight(Record):
    """weight of one morph target"""
    NAME: ClassVar[str] = "morph_weight"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.real("weight", -1e6, 1e6),
    )
    weight: float = 0.0


@dataclass
class ClipUse(Record):
    """a clip that a job plays

    start_s: time of the job at which the clip begins; before it the clip's first pose holds
    speed: seconds of the clip in a second of the job
    loop: 1: begins again at its end, for ever; 0: its last pose holds
    """
    NAME: ClassVar[str] = "clip_use"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("clip", "I", 1, 4294967295),
        _f.real("start_s", -1e6, 1e6),
        _f.real("speed", 0.001, 1000.0),
        _f.whole("loop", "I", 0, 1),
    )
    clip: int = 1
    start_s: float = 0.0
    speed: float = 0.001
    loop: int = 0


@dataclass
class FramePart(Record):
    """a part of a frame"""
    NAME: ClassVar[str] = "frame_part"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.choice("kind", FramePartKind),
        _f.whole("size_bytes", "Q", 1, 4294967296),
    )
    kind: FramePartKind | str = FramePartKind(0)
    size_bytes: int = 1


@dataclass
class StageTime(Record):
    """one span of time

    stage: the activity
    clock: who measured
    wave: number of the wave within its frame, in order; of a build: the part of the structure
    start_ns: since the frame began, nanoseconds
    duration_ns: nanoseconds
    """
    NAME: ClassVar[str] = "stage_time"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.choice("stage", Stage),
        _f.choice("clock", Clock),
        _f.whole("wave", "I", 0, 65535),
        _f.whole("start_ns", "Q", 0, 18446744073709551615),
        _f.whole("duration_ns", "Q", 0, 18446744073709551615),
    )
    stage: Stage | str = Stage(0)
    clock: Clock | str = Clock(0)
    wave: int = 0
    start_ns: int = 0
    duration_ns: int = 0


@dataclass
class StageTotal(Record):
    """sums over the daemon's life

    stage: the activity
    clock: who measured
    count: spans
    total_ns: nanoseconds
    max_ns: nanoseconds
    """
    NAME: ClassVar[str] = "stage_total"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.choice("stage", Stage),
        _f.choice("clock", Clock),
        _f.whole("count", "Q", 0, 18446744073709551615),
        _f.whole("total_ns", "Q", 0, 18446744073709551615),
        _f.whole("max_ns", "Q", 0, 18446744073709551615),
    )
    stage: Stage | str = Stage(0)
    clock: Clock | str = Clock(0)
    count: int = 0
    total_ns: int = 0
    max_ns: int = 0


@dataclass
class ClientStat(Record):
    """one connected client

    client: number, counted from 1 since the start
    connected_ns: for how long
    received_bytes: from it
    sent_bytes: to it
    bulk_bytes: blob bytes received from it
    requests: in flight
    scenes: open
    name: its own name, and its user
    """
    NAME: ClassVar[str] = "client_stat"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("client", "Q", 0, 18446744073709551615),
        _f.whole("connected_ns", "Q", 0, 18446744073709551615),
        _f.whole("received_bytes", "Q", 0, 18446744073709551615),
        _f.whole("sent_bytes", "Q", 0, 18446744073709551615),
        _f.whole("bulk_bytes", "Q", 0, 18446744073709551615),
        _f.whole("requests", "I", 0, 4294967295),
        _f.whole("scenes", "I", 0, 4294967295),
        _f.text("name", 64),
    )
    client: int = 0
    connected_ns: int = 0
    received_bytes: int = 0
    sent_bytes: int = 0
    bulk_bytes: int = 0
    requests: int = 0
    scenes: int = 0
    name: str = ""


@dataclass
class JobStat(Record):
    """one job

    client: whose it is, as in client_stat
    running_ns: for how long it has been there
    frames_sent: to the client
    frames_total: of the batch; 0: a view, which has no end
    frame: number of the batch's next frame to be sent
    owner: its user or key, or where it comes from
    scene: name; empty if the scene belongs to another user or key, and the asking client may not attach to it
    """
    NAME: ClassVar[str] = "job_stat"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("client", "Q", 0, 18446744073709551615),
        _f.whole("running_ns", "Q", 0, 18446744073709551615),
        _f.whole("frames_sent", "Q", 0, 18446744073709551615),
        _f.whole("frames_total", "Q", 0, 18446744073709551615),
        _f.whole("frame", "I", 0, 4294967295),
        _f.choice("kind", JobKind),
        _f.choice("tracer", Tracer),
        _f.text("owner", 48),
        _f.text("scene", 128),
    )
    client: int = 0
    running_ns: int = 0
    frames_sent: int = 0
    frames_total: int = 0
    frame: int = 0
    kind: JobKind | str = JobKind(0)
    tracer: Tracer | str = Tracer(0)
    owner: str = ""
    scene: str = ""


@dataclass
class SceneStat(Record):
    """one scene in memory

    client: the first client that holds it; 0: none, it lingers
    scene: its identifier there
    revision: of the last transaction
    instances: nodes with geometry
    triangles: stored once each
    spheres: stored once each
    host_bytes: host memory
    device_bytes: device memory, acceleration structure included
    name: empty also if it belongs to another user or key, and the client may not attach to it
    """
    NAME: ClassVar[str] = "scene_stat"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("client", "Q", 0, 18446744073709551615),
        _f.whole("scene", "I", 0, 4294967295),
        _f.whole("revision", "Q", 0, 18446744073709551615),
        _f.whole("nodes", "I", 0, 4294967295),
        _f.whole("instances", "I", 0, 4294967295),
        _f.whole("triangles", "Q", 0, 18446744073709551615),
        _f.whole("spheres", "Q", 0, 18446744073709551615),
        _f.whole("host_bytes", "Q", 0, 18446744073709551615),
        _f.whole("device_bytes", "Q", 0, 18446744073709551615),
        _f.text("name", 128),
    )
    client: int = 0
    scene: int = 0
    revision: int = 0
    nodes: int = 0
    instances: int = 0
    triangles: int = 0
    spheres: int = 0
    host_bytes: int = 0
    device_bytes: int = 0
    name: str = ""


@dataclass
class WaveComparison(Record):
    """the answers of two tracers to the rays of one wave and kind, compared ray by ray, over all slices and samples of
    a frame. A closest-hit ray hits if it meets a surface, a shadow ray if it is not fully lit. Maximum errors are
    exact, medians and percentiles accurate to 1 %

    wave: number of the wave within its frame, in order; shadow rays have that of the hits that emitted them
    rays: alive; the next four add up to it
    both_hit: hits with both
    both_missed: misses with both
    only_tracer: hits only with the job's tracer
    only_reference: hits only with compare_with
    far: of both_hit: the distances differ by more than compare_far; shadow rays: the transmittances by more than 2/255
    edges: of only_tracer, only_reference and far: rays within rounding of an edge, as compare_with itself gives the
        tracer's answer to a ray that is moved by a few rounding steps
    other_surface: of both_hit: hits at the same distance, not on an edge, whose normals are more than 5 degrees apart,
        or whose material or side differs; they are no agreement
    tracer_ns: spent by the job's tracer, nanoseconds
    reference_ns: spent by compare_with, nanoseconds
    distance_median: of rays that hit with both and are on no edge: difference in world space, in scene diagonals
    distance_p99: 99th percentile of the same
    distance_max: of the same
    relative_median: of the same rays: difference as a share of compare_with's distance
    normal_median: of those that are not far either: between the shading normals, degrees
    normal_p99: 99th percentile of the same
    normal_max: of the same
    """
    NAME: ClassVar[str] = "wave_comparison"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("wave", "I", 0, 65535),
        _f.choice("kind", RayKind),
        _f.whole("rays", "Q", 0, 18446744073709551615),
        _f.whole("both_hit", "Q", 0, 18446744073709551615),
        _f.whole("both_missed", "Q", 0, 18446744073709551615),
        _f.whole("only_tracer", "Q", 0, 18446744073709551615),
        _f.whole("only_reference", "Q", 0, 18446744073709551615),
        _f.whole("far", "Q", 0, 18446744073709551615),
        _f.whole("edges", "Q", 0, 18446744073709551615),
        _f.whole("other_surface", "Q", 0, 18446744073709551615),
        _f.whole("tracer_ns", "Q", 0, 18446744073709551615),
        _f.whole("reference_ns", "Q", 0, 18446744073709551615),
        _f.real("distance_median", 0.0, 1e30),
        _f.real("distance_p99", 0.0, 1e30),
        _f.real("distance_max", 0.0, 1e30),
        _f.real("relative_median", 0.0, 1e30),
        _f.real("normal_median", 0.0, 180.1),
        _f.real("normal_p99", 0.0, 180.1),
        _f.real("normal_max", 0.0, 180.1),
    )
    wave: int = 0
    kind: RayKind | str = RayKind(0)
    rays: int = 0
    both_hit: int = 0
    both_missed: int = 0
    only_tracer: int = 0
    only_reference: int = 0
    far: int = 0
    edges: int = 0
    other_surface: int = 0
    tracer_ns: int = 0
    reference_ns: int = 0
    distance_median: float = 0.0
    distance_p99: float = 0.0
    distance_max: float = 0.0
    relative_median: float = 0.0
    normal_median: float = 0.0
    normal_p99: float = 0.0
    normal_max: float = 0.0


@dataclass
class SceneEntry(Record):
    """a scene that a client may attach to

    revision: of the last transaction
    clients: attached now
    """
    NAME: ClassVar[str] = "scene_entry"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("revision", "Q", 0, 18446744073709551615),
        _f.whole("triangles", "Q", 0, 18446744073709551615),
        _f.whole("clients", "I", 0, 4294967295),
        _f.choice("sharing", Sharing),
        _f.text("name", 128),
    )
    revision: int = 0
    triangles: int = 0
    clients: int = 0
    sharing: Sharing | str = Sharing(0)
    name: str = ""


@dataclass
class CameraEntry(Record):
    """a camera of a scene

    node: the node that shows it
    fov_y: vertical field of view; 0: orthographic
    name: the node's name, or the camera's if the node has none
    """
    NAME: ClassVar[str] = "camera_entry"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("node", "I", 1, 4294967295),
        _f.real("fov_y", 0.0, 3.1),
        _f.text("name", 128),
    )
    node: int = 1
    fov_y: float = 0.0
    name: str = ""


@dataclass
class ObjectEntry(Record):
    """an object of a scene

    parent: of a node: the one above it; else 0
    shows_kind: of a node: what it shows; else group
    shows: of a node: the identifier of that; else 0
    """
    NAME: ClassVar[str] = "object_entry"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("object", "I", 1, 4294967295),
        _f.whole("parent", "I", 0, 4294967295),
        _f.choice("shows_kind", NodeKind),
        _f.whole("shows", "I", 0, 4294967295),
        _f.text("name", 128),
    )
    object: int = 1
    parent: int = 0
    shows_kind: NodeKind | str = NodeKind(0)
    shows: int = 0
    name: str = ""


@dataclass
class ClipEntry(Record):
    """a clip of a scene

    duration_s: time of its last key
    """
    NAME: ClassVar[str] = "clip_entry"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("clip", "I", 1, 4294967295),
        _f.whole("channels", "I", 0, 4294967295),
        _f.real("duration_s", 0.0, 1e9),
        _f.text("name", 128),
    )
    clip: int = 1
    channels: int = 0
    duration_s: float = 0.0
    name: str = ""


@dataclass
class StructureRow(Record):
    """one property of a tracer's acceleration structure, or of the waves that it traced, in the tracer's words

    part: number of the part; build times have it in place of a wave
    number: the value, of the units number and built
    measure: the value, of other units
    name: as `static/resolution`: the word before the slash names a part of the structure, if it has several, or the
        kind of the waves, such as `shadow`
    warning: what the picture lacks because of this value, and the remedy; empty: nothing
    """
    NAME: ClassVar[str] = "structure_row"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("part", "I", 0, 65535),
        _f.choice("unit", Unit),
        _f.whole("number", "Q", 0, 18446744073709551615),
        _f.real("measure", 0.0, 3e38),
        _f.text("name", 47),
        _f.text("warning", 255),
    )
    part: int = 0
    unit: Unit | str = Unit(0)
    number: int = 0
    measure: float = 0.0
    name: str = ""
    warning: str = ""


@dataclass
class Ok(Message):
    """the request was carried out; its only answer

    revision: scene revision after a transaction, else 0
    """
    TYPE: ClassVar[int] = 0x0001
    SENDER: ClassVar[str] = "server"
    NAME: ClassVar[str] = "ok"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("revision", "Q", 0, 18446744073709551615),
    )
    revision: int = 0


@dataclass
class Error(Message):
    """the request was not carried out; its only answer. Request 0: the connection

    retryable: 1: the same request may succeed later
    retry_after_ms: 0: unknown
    field: the field or object at fault, as a path
    text: what is wrong
    remedy: what to do about it
    """
    TYPE: ClassVar[int] = 0x0002
    SENDER: ClassVar[str] = "server"
    NAME: ClassVar[str] = "error"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.choice("code", ErrorCode),
        _f.whole("retryable", "I", 0, 1),
        _f.whole("retry_after_ms", "I", 0, 3600000),
        _f.text("field", 128),
        _f.text("text", 512),
        _f.text("remedy", 256),
    )
    code: ErrorCode | str = ErrorCode(0)
    retryable: int = 0
    retry_after_ms: int = 0
    field: str = ""
    text: str = ""
    remedy: str = ""


@dataclass
class Ping(Message):
    """answered by a pong of the same request

    sent_ns: the sender's clock, returned unchanged
    """
    TYPE: ClassVar[int] = 0x0003
    SENDER: ClassVar[str] = "both"
    NAME: ClassVar[str] = "ping"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("sent_ns", "Q", 0, 18446744073709551615),
    )
    sent_ns: int = 0


@dataclass
class Pong(Message):
    """the answer to a ping

    sent_ns: from the ping
    received_ns: the clock of the pong's sender
    """
    TYPE: ClassVar[int] = 0x0004
    SENDER: ClassVar[str] = "both"
    NAME: ClassVar[str] = "pong"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("sent_ns", "Q", 0, 18446744073709551615),
        _f.whole("received_ns", "Q", 0, 18446744073709551615),
    )
    sent_ns: int = 0
    received_ns: int = 0


@dataclass
class Goodbye(Message):
    """the last message; the peer closes

    code: none: no error
    text: why
    """
    TYPE: ClassVar[int] = 0x0005
    SENDER: ClassVar[str] = "both"
    NAME: ClassVar[str] = "goodbye"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.choice("code", ErrorCode),
        _f.text("text", 512),
    )
    code: ErrorCode | str = ErrorCode(0)
    text: str = ""


@dataclass
class Cancel(Message):
    """ends a request: it is answered with error `cancelled` (or its real answer), then this one with ok

    target_request: the request to end
    """
    TYPE: ClassVar[int] = 0x0006
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "cancel"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("target_request", "I", 1, 4294967295),
    )
    target_request: int = 1


@dataclass
class Credit(Message):
    """raises the total that may have been sent on a channel since it was opened; absolute, so it cannot drift

    channel: upload channel 1: bytes of blob data; a job's channel: frames
    total: bytes (upload) or frames (job)
    """
    TYPE: ClassVar[int] = 0x0007
    SENDER: ClassVar[str] = "both"
    NAME: ClassVar[str] = "credit"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("channel", "I", 0, 4294967295),
        _f.whole("total", "Q", 0, 18446744073709551615),
    )
    channel: int = 0
    total: int = 0


@dataclass
class Blocked(Message):
    """says why nothing is sent; may be ignored

    total: exhausted credit; view: frames sent
    text: why
    """
    TYPE: ClassVar[int] = 0x8008
    SENDER: ClassVar[str] = "both"
    NAME: ClassVar[str] = "blocked"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("channel", "I", 0, 4294967295),
        _f.whole("total", "Q", 0, 18446744073709551615),
        _f.text("text", 128),
    )
    channel: int = 0
    total: int = 0
    text: str = ""


@dataclass
class Stats(Message):
    """asks for a stats reply"""
    TYPE: ClassVar[int] = 0x0009
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "stats"
    FIELDS: ClassVar[tuple[Field, ...]] = (
    )


@dataclass
class StatsReply(Message):
    """the daemon's state; the answer to stats. The totals cover all clients. A client that may only look gets itself
    alone, and the scenes that it may attach to

    frames: rendered since the start
    rays: traced since the start
    host_bytes: scene memory on the host
    host_limit_bytes: its limit
    device_bytes: device memory
    device_limit_bytes: its limit
    blob_bytes: blobs held
    jobs: running or waiting
    device_objects: live OpenGL objects: buffers, textures and the like. Programs are not counted, as they are kept for
        reuse
    version: of the daemon
    device: GPU, as the driver names it
    driver: OpenGL version, as the driver names it
    running: the jobs, by client
    """
    TYPE: ClassVar[int] = 0x000a
    SENDER: ClassVar[str] = "server"
    NAME: ClassVar[str] = "stats_reply"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("uptime_ns", "Q", 0, 18446744073709551615),
        _f.whole("frames", "Q", 0, 18446744073709551615),
        _f.whole("rays", "Q", 0, 18446744073709551615),
        _f.whole("host_bytes", "Q", 0, 18446744073709551615),
        _f.whole("host_limit_bytes", "Q", 0, 18446744073709551615),
        _f.whole("device_bytes", "Q", 0, 18446744073709551615),
        _f.whole("device_limit_bytes", "Q", 0, 18446744073709551615),
        _f.whole("blob_bytes", "Q", 0, 18446744073709551615),
        _f.whole("blobs", "I", 0, 4294967295),
        _f.whole("jobs", "I", 0, 4294967295),
        _f.whole("device_objects", "I", 0, 4294967295),
        _f.text("version", 32),
        _f.text("device", 128),
        _f.text("driver", 128),
        _f.array("clients", ClientStat, 256),
        _f.array("scenes", SceneStat, 256),
        _f.array("stages", StageTotal, 64),
        _f.array("running", JobStat, 256),
    )
    uptime_ns: int = 0
    frames: int = 0
    rays: int = 0
    host_bytes: int = 0
    host_limit_bytes: int = 0
    device_bytes: int = 0
    device_limit_bytes: int = 0
    blob_bytes: int = 0
    blobs: int = 0
    jobs: int = 0
    device_objects: int = 0
    version: str = ""
    device: str = ""
    driver: str = ""
    clients: Sequence[ClientStat] = ()
    scenes: Sequence[SceneStat] = ()
    stages: Sequence[StageTotal] = ()
    running: Sequence[JobStat] = ()


@dataclass
class SceneOpen(Message):
    """creates an empty scene of revision 0; answered by ok

    scene: identifier, unused so far on this connection
    name: for people; of a kept or shared scene: not empty, and unique among those of the same user or key; of a shared
        one: unique among shared scenes
    """
    TYPE: ClassVar[int] = 0x0101
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "scene_open"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("scene", "I", 1, 4294967295),
        _f.choice("sharing", Sharing),
        _f.text("name", 128),
    )
    scene: int = 1
    sharing: Sharing | str = Sharing(0)
    name: str = ""


@dataclass
class SceneClose(Message):
    """releases a scene and ends the client's jobs on it; the scene itself ends with its last client, a kept or shared
    one lingers. Answered by ok"""
    TYPE: ClassVar[int] = 0x0102
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "scene_close"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("scene", "I", 1, 4294967295),
    )
    scene: int = 1


@dataclass
class SceneAttach(Message):
    """attaches to an existing scene; answered by ok with its revision. From then on the client is told of its changes

    scene: identifier, unused so far on this connection
    name: that of scene_open; a scene kept for the client has precedence over a shared one
    """
    TYPE: ClassVar[int] = 0x0103
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "scene_attach"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("scene", "I", 1, 4294967295),
        _f.text("name", 128),
    )
    scene: int = 1
    name: str = ""


@dataclass
class SceneList(Message):
    """asks which scenes the client may attach to; answered by scene_list_reply"""
    TYPE: ClassVar[int] = 0x0104
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "scene_list"
    FIELDS: ClassVar[tuple[Field, ...]] = (
    )


@dataclass
class SceneListReply(Message):
    """the answer to scene_list, by name"""
    TYPE: ClassVar[int] = 0x0105
    SENDER: ClassVar[str] = "server"
    NAME: ClassVar[str] = "scene_list_reply"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.array("scenes", SceneEntry, 256),
    )
    scenes: Sequence[SceneEntry] = ()


@dataclass
class SceneDescribe(Message):
    """asks for a scene's contents; answered by scene_description"""
    TYPE: ClassVar[int] = 0x0106
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "scene_describe"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("scene", "I", 1, 4294967295),
    )
    scene: int = 1


@dataclass
class SceneDescription(Message):
    """the answer to scene_describe

    triangles: stored once each
    spheres: stored once each
    empty: 1: nothing is visible, the bounds mean nothing
    lower_world: of what is visible
    cameras: ascending by node; the first ones
    clips: ascending; the first ones
    """
    TYPE: ClassVar[int] = 0x0107
    SENDER: ClassVar[str] = "server"
    NAME: ClassVar[str] = "scene_description"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("revision", "Q", 0, 18446744073709551615),
        _f.whole("triangles", "Q", 0, 18446744073709551615),
        _f.whole("spheres", "Q", 0, 18446744073709551615),
        _f.whole("nodes", "I", 0, 4294967295),
        _f.whole("empty", "I", 0, 1),
        _f.real("lower_world", -3e38, 3e38, 3),
        _f.real("upper_world", -3e38, 3e38, 3),
        _f.array("cameras", CameraEntry, 256),
        _f.array("clips", ClipEntry, 256),
    )
    revision: int = 0
    triangles: int = 0
    spheres: int = 0
    nodes: int = 0
    empty: int = 0
    lower_world: Sequence[float] = (0.0, 0.0, 0.0)
    upper_world: Sequence[float] = (0.0, 0.0, 0.0)
    cameras: Sequence[CameraEntry] = ()
    clips: Sequence[ClipEntry] = ()


@dataclass
class SceneChanged(Message):
    """another client has changed a scene

    revision: of the last transaction
    """
    TYPE: ClassVar[int] = 0x8108
    SENDER: ClassVar[str] = "server"
    NAME: ClassVar[str] = "scene_changed"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("scene", "I", 1, 4294967295),
        _f.whole("revision", "Q", 0, 18446744073709551615),
    )
    scene: int = 1
    revision: int = 0


@dataclass
class SceneObjects(Message):
    """asks for the names of a scene's objects; answered by scene_objects_reply. For daemons with that capability, as
    object_get and `base_revision` of edit_begin

    object: only the one with this identifier; 0: all
    from_: where to go on: `next` of the previous reply; 0: from the beginning
    name: only those with this name; empty: all
    """
    TYPE: ClassVar[int] = 0x0109
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "scene_objects"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("scene", "I", 1, 4294967295),
        _f.choice("kind", ObjectKind),
        _f.whole("object", "I", 0, 4294967295),
        _f.whole("from_", "I", 0, 4294967295),
        _f.text("name", 128),
    )
    scene: int = 1
    kind: ObjectKind | str = ObjectKind(0)
    object: int = 0
    from_: int = 0
    name: str = ""


@dataclass
class SceneObjectsReply(Message):
    """the answer to scene_objects. It has as many objects as fit, and looks at 65536 at most, so that it may have none
    although more follow

    total: objects of that kind in the scene
    next: 0: there are no more; else where the next question goes on. An object that is removed in between may hide
        another one from the list
    objects: in no order
    """
    TYPE: ClassVar[int] = 0x010a
    SENDER: ClassVar[str] = "server"
    NAME: ClassVar[str] = "scene_objects_reply"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("revision", "Q", 0, 18446744073709551615),
        _f.whole("total", "I", 0, 4294967295),
        _f.whole("next", "I", 0, 4294967295),
        _f.array("objects", ObjectEntry, 256),
    )
    revision: int = 0
    total: int = 0
    next: int = 0
    objects: Sequence[ObjectEntry] = ()


@dataclass
class ObjectGet(Message):
    """asks for an object as it is, whatever clips do to it. The daemon sends the edit that would make it (set_node,
    set_material, set_light, set_camera or set_environment, that one with `keeps_image`) with the same request, then
    answers by ok with the scene's revision

    kind: node, material, light, camera or environment
    object: of the environment 1
    """
    TYPE: ClassVar[int] = 0x010b
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "object_get"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("scene", "I", 1, 4294967295),
        _f.choice("kind", ObjectKind),
        _f.whole("object", "I", 1, 4294967295),
    )
    scene: int = 1
    kind: ObjectKind | str = ObjectKind(0)
    object: int = 1


@dataclass
class BlobOffer(Message):
    """names blobs that edits will use; answered by blob_need. The connection holds them until it ends"""
    TYPE: ClassVar[int] = 0x0110
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "blob_offer"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.array("blobs", BlobRef, 1024),
    )
    blobs: Sequence[BlobRef] = ()


@dataclass
class BlobNeed(Message):
    """which of the offered blobs are to be sent; the answer to blob_offer"""
    TYPE: ClassVar[int] = 0x0111
    SENDER: ClassVar[str] = "server"
    NAME: ClassVar[str] = "blob_need"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.array("needed", BlobIndex, 1024),
    )
    needed: Sequence[BlobIndex] = ()


@dataclass
class BlobData(Message):
    """a chunk of a needed blob, on channel 1, in order. All chunks of a blob carry one request, answered by ok once all
    have arrived and the hash is right

    offset_bytes: position in the blob
    hash: which blob
    """
    TYPE: ClassVar[int] = 0x0112
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "blob_data"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("offset_bytes", "Q", 0, 17179869184),
        _f.exactly("hash", 32),
        _f.bulk("data", 262144),
    )
    offset_bytes: int = 0
    hash: bytes = bytes(32)
    data: Bytes = b""


@dataclass
class EditBegin(Message):
    """opens a transaction: the edits that follow with the same request belong to it, all or none are applied

    base_revision: above 0: the edits change objects as they were at this revision: the transaction is refused with
        `conflict` if one that it sets or removes is not there, or has been changed since. 0: whatever is there is
        replaced
    """
    TYPE: ClassVar[int] = 0x0120
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "edit_begin"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("scene", "I", 1, 4294967295),
        _f.whole("base_revision", "Q", 0, 18446744073709551615),
    )
    scene: int = 1
    base_revision: int = 0


@dataclass
class EditCommit(Message):
    """applies the transaction; answered by ok with the new revision, or by an error, for the whole request"""
    TYPE: ClassVar[int] = 0x0121
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "edit_commit"
    FIELDS: ClassVar[tuple[Field, ...]] = (
    )


@dataclass
class SetNode(Message):
    """edit: creates or changes a node. The parent must exist when the transaction is committed; cycles are refused

    parent: 0: the root
    object: mesh, spheres, light or camera; 0 for a group
    hidden: 1: it and all below do not appear
    parent_from_node: 3x4 row-major
    skin: for a mesh with joints: the skin that moves it, which has every joint that the mesh refers to; the joints
        alone place its vertices, whatever the node's own transform. A mesh without joints is not moved. 0: none
    weights: of the mesh's morph targets, missing ones are 0, further ones do nothing; none at all: the mesh's own
    """
    TYPE: ClassVar[int] = 0x0130
    SENDER: ClassVar[str] = "both"
    NAME: ClassVar[str] = "set_node"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("node", "I", 1, 4294967295),
        _f.whole("parent", "I", 0, 4294967295),
        _f.choice("kind", NodeKind),
        _f.whole("object", "I", 0, 4294967295),
        _f.whole("hidden", "I", 0, 1),
        _f.real("parent_from_node", -1e12, 1e12, 12),
        _f.whole("skin", "I", 0, 4294967295),
        _f.array("weights", MorphWeight, 1024),
        _f.text("name", 128),
    )
    node: int = 1
    parent: int = 0
    kind: NodeKind | str = NodeKind(0)
    object: int = 0
    hidden: int = 0
    parent_from_node: Sequence[float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    skin: int = 0
    weights: Sequence[MorphWeight] = ()
    name: str = ""


@dataclass
class SetMesh(Message):
    """edit: a triangle mesh. Arrays are blobs of little-endian elements, one per vertex

    influence_count: joints that move one vertex; 0: no skin can
    target_count: morph targets
    closed: 1: its triangles bound a body, consistently wound: with vertices at one position merged, every edge occurs
        equally often in both directions, and no triangle occurs with both orientations. Only sampled structures depend
        on it
    arrays: by position: 0 positions 3 f32; 1 indices 3 u32 per triangle; 2 normals 3 f32; 3 tangents 4 f32; 4, 5
        texture coordinate sets 2 f32; 6 colours 4 u8, or 4 u16 of which 65535 is 1, linear; 7 joints influence_count
        u16, indices into the skin; 8 their weights influence_count f32, not negative, normalised to a sum of 1; 9, 10,
        11 offsets of the morph targets for positions, normals and tangents, 3 f32 per vertex, target after target. All
        but 0 and 1 may be missing (0 bytes, or the array is shorter); 7 and 8 come together, 9 comes with target_count
    ranges: ascending, without overlap; triangles outside have the default material
    weights: of the morph targets, if a node has none of its own; missing ones are 0
    """
    TYPE: ClassVar[int] = 0x0131
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "set_mesh"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("mesh", "I", 1, 4294967295),
        _f.whole("vertex_count", "I", 1, 4294967295),
        _f.whole("triangle_count", "I", 1, 1431655765),
        _f.whole("influence_count", "I", 0, 16),
        _f.whole("target_count", "I", 0, 1024),
        _f.whole("closed", "I", 0, 1),
        _f.array("arrays", BlobRef, 12),
        _f.array("ranges", MaterialRange, 4096),
        _f.array("weights", MorphWeight, 1024),
        _f.text("name", 128),
    )
    mesh: int = 1
    vertex_count: int = 1
    triangle_count: int = 1
    influence_count: int = 0
    target_count: int = 0
    closed: int = 0
    arrays: Sequence[BlobRef] = ()
    ranges: Sequence[MaterialRange] = ()
    weights: Sequence[MorphWeight] = ()
    name: str = ""


@dataclass
class SetSpheres(Message):
    """edit: a set of exact spheres

    arrays: 0: centre and radius, 4 f32 per sphere
    ranges: ascending, without overlap
    """
    TYPE: ClassVar[int] = 0x0132
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "set_spheres"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("spheres", "I", 1, 4294967295),
        _f.whole("sphere_count", "I", 1, 4294967295),
        _f.array("arrays", BlobRef, 1),
        _f.array("ranges", MaterialRange, 4096),
        _f.text("name", 128),
    )
    spheres: int = 1
    sphere_count: int = 1
    arrays: Sequence[BlobRef] = ()
    ranges: Sequence[MaterialRange] = ()
    name: str = ""


@dataclass
class SetDisc(Message):
    """edit: a disc outside every hierarchy, such as a ground plane

    normal_world: unit length to 1 part in 1000
    """
    TYPE: ClassVar[int] = 0x0133
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "set_disc"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("disc", "I", 1, 4294967295),
        _f.whole("material", "I", 0, 4294967295),
        _f.real("centre_world", -1e12, 1e12, 3),
        _f.real("normal_world", -1.0, 1.0, 3),
        _f.real("radius", 1e-12, 1e12),
        _f.text("name", 128),
    )
    disc: int = 1
    material: int = 0
    centre_world: Sequence[float] = (0.0, 0.0, 0.0)
    normal_world: Sequence[float] = (0.0, 0.0, 0.0)
    radius: float = 1e-12
    name: str = ""


@dataclass
class SetMaterial(Message):
    """edit: metallic-roughness material of glTF 2.0 with transmission and emission

    unlit: 1: base colour is shown as it is
    base_colour: linear, alpha last
    emission: radiance, W/(m2 sr)
    roughness: perceptual; 0 is a perfect mirror or clear glass
    transmission: share of the light that is not reflected and enters
    ior: index of refraction; 1.5 is glTF's default
    alpha_cutoff: for alpha mode mask
    anisotropy: of rough reflections: their elongation along the grain, as in KHR_materials_anisotropy
    anisotropy_rotation: of the grain from the tangent, counter-clockwise
    emission_seen_only: 1: the emission is seen by the eye, also in smooth mirrors and through glass, and lights
        nothing: a light shines in its place, and would be counted twice
    specular: share of what Fresnel's equations say that a dielectric mirrors, as in KHR_materials_specular
    specular_red: colour of that mirror seen from above; at grazing angles it is white
    attenuation_distance: metres of the world on which the light in a body of glass falls to the attenuation colour, as
        in KHR_materials_volume; 0: it is clear
    thickness: metres of the body, about: what shadow rays straight through it take its attenuation over
    clearcoat: share of the surface under a clear varnish, as in KHR_materials_clearcoat
    clearcoat_roughness: of the varnish
    sheen: colour of the fibres of cloth, as in KHR_materials_sheen; black: there are none
    sheen_roughness: of the fibres
    iridescence: share of a thin film, whose two sides' light interferes, as in KHR_materials_iridescence
    iridescence_ior: index of refraction of the film
    iridescence_minimum_nm: thickness of the film where its texture is 0
    iridescence_maximum_nm: thickness where it is 1, or there is no texture
    dispersion: of glass: 20 / its Abbe number, as in KHR_materials_dispersion
    diffuse_transmission: share of the scattered light that leaves at the other side, as in
        KHR_materials_diffuse_transmission
    diffuse_transmission_red: colour of the light that does
    thin_walled: 1: the surface is a pane without a body, through which light goes straight on
    textures: by position, as material_texture says
    """
    TYPE: ClassVar[int] = 0x0134
    SENDER: ClassVar[str] = "both"
    NAME: ClassVar[str] = "set_material"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("material", "I", 1, 4294967295),
        _f.choice("alpha_mode", AlphaMode),
        _f.whole("double_sided", "I", 0, 1),
        _f.whole("unlit", "I", 0, 1),
        _f.real("base_colour", 0.0, 1.0, 4),
        _f.real("emission", 0.0, 1e6, 3),
        _f.real("metallic", 0.0, 1.0),
        _f.real("roughness", 0.0, 1.0),
        _f.real("transmission", 0.0, 1.0),
        _f.real("ior", 1.0, 10.0),
        _f.real("alpha_cutoff", 0.0, 1.0),
        _f.real("anisotropy", 0.0, 1.0),
        _f.real("anisotropy_rotation", -1000.0, 1000.0),
        _f.whole("emission_seen_only", "I", 0, 1),
        _f.real("specular", 0.0, 1.0),
        _f.real("specular_red", 0.0, 1000.0),
        _f.real("specular_green", 0.0, 1000.0),
        _f.real("specular_blue", 0.0, 1000.0),
        _f.real("attenuation_distance", 0.0, 1e12),
        _f.real("attenuation_red", 0.0, 1.0),
        _f.real("attenuation_green", 0.0, 1.0),
        _f.real("attenuation_blue", 0.0, 1.0),
        _f.real("thickness", 0.0, 1e12),
        _f.real("clearcoat", 0.0, 1.0),
        _f.real("clearcoat_roughness", 0.0, 1.0),
        _f.real("sheen", 0.0, 1.0, 3),
        _f.real("sheen_roughness", 0.0, 1.0),
        _f.real("iridescence", 0.0, 1.0),
        _f.real("iridescence_ior", 1.0, 10.0),
        _f.real("iridescence_minimum_nm", 0.0, 1e6),
        _f.real("iridescence_maximum_nm", 0.0, 1e6),
        _f.real("dispersion", 0.0, 100.0),
        _f.real("diffuse_transmission", 0.0, 1.0),
        _f.real("diffuse_transmission_red", 0.0, 1.0),
        _f.real("diffuse_transmission_green", 0.0, 1.0),
        _f.real("diffuse_transmission_blue", 0.0, 1.0),
        _f.whole("thin_walled", "I", 0, 1),
        _f.array("textures", TextureUse, 24),
        _f.text("name", 128),
    )
    material: int = 1
    alpha_mode: AlphaMode | str = AlphaMode(0)
    double_sided: int = 0
    unlit: int = 0
    base_colour: Sequence[float] = (0.0, 0.0, 0.0, 0.0)
    emission: Sequence[float] = (0.0, 0.0, 0.0)
    metallic: float = 0.0
    roughness: float = 0.0
    transmission: float = 0.0
    ior: float = 1.0
    alpha_cutoff: float = 0.0
    anisotropy: float = 0.0
    anisotropy_rotation: float = 0.0
    emission_seen_only: int = 0
    specular: float = 1.0
    specular_red: float = 1.0
    specular_green: float = 1.0
    specular_blue: float = 1.0
    attenuation_distance: float = 0.0
    attenuation_red: float = 1.0
    attenuation_green: float = 1.0
    attenuation_blue: float = 1.0
    thickness: float = 0.0
    clearcoat: float = 0.0
    clearcoat_roughness: float = 0.0
    sheen: Sequence[float] = (0.0, 0.0, 0.0)
    sheen_roughness: float = 0.0
    iridescence: float = 0.0
    iridescence_ior: float = 1.3
    iridescence_minimum_nm: float = 100.0
    iridescence_maximum_nm: float = 400.0
    dispersion: float = 0.0
    diffuse_transmission: float = 0.0
    diffuse_transmission_red: float = 1.0
    diffuse_transmission_green: float = 1.0
    diffuse_transmission_blue: float = 1.0
    thin_walled: int = 0
    textures: Sequence[TextureUse] = ()
    name: str = ""


@dataclass
class SetTexture(Message):
    """edit: an image, rows from the top, four bytes per texel

    width: texels
    height: texels
    nearest: 1: no interpolation
    arrays: 0: width x height x 4 bytes
    """
    TYPE: ClassVar[int] = 0x0135
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "set_texture"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("texture", "I", 1, 4294967295),
        _f.whole("width", "I", 1, 16384),
        _f.whole("height", "I", 1, 16384),
        _f.choice("format", TextureFormat),
        _f.choice("wrap_u", Wrap),
        _f.choice("wrap_v", Wrap),
        _f.whole("nearest", "I", 0, 1),
        _f.array("arrays", BlobRef, 1),
        _f.text("name", 128),
    )
    texture: int = 1
    width: int = 1
    height: int = 1
    format: TextureFormat | str = TextureFormat(0)
    wrap_u: Wrap | str = Wrap(0)
    wrap_v: Wrap | str = Wrap(0)
    nearest: int = 0
    arrays: Sequence[BlobRef] = ()
    name: str = ""


@dataclass
class SetLight(Message):
    """edit: a light; it shines where a node shows it

    kind: gives the unit of the colour
    colour: power in the kind's unit
    range: point and spot: no light beyond; 0: unlimited
    inner_cone: spot: half angle of full light
    outer_cone: spot: half angle where it ends; at least the inner one
    size: rectangle: width and height; sphere: radius in the first
    """
    TYPE: ClassVar[int] = 0x0136
    SENDER: ClassVar[str] = "both"
    NAME: ClassVar[str] = "set_light"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("light", "I", 1, 4294967295),
        _f.choice("kind", LightKind),
        _f.real("colour", 0.0, 1e12, 3),
        _f.real("range", 0.0, 1e12),
        _f.real("inner_cone", 0.0, 1.5708),
        _f.real("outer_cone", 0.0, 1.5708),
        _f.real("size", 0.0, 1e12, 2),
        _f.text("name", 128),
    )
    light: int = 1
    kind: LightKind | str = LightKind(0)
    colour: Sequence[float] = (0.0, 0.0, 0.0)
    range: float = 0.0
    inner_cone: float = 0.0
    outer_cone: float = 0.0
    size: Sequence[float] = (0.0, 0.0)
    name: str = ""


@dataclass
class SetCamera(Message):
    """edit: a perspective or orthographic camera; it looks along -z of its node, y is up

    fov_y: vertical field of view; 0: orthographic
    height: orthographic: height of the view
    near: nearest visible distance
    """
    TYPE: ClassVar[int] = 0x0137
    SENDER: ClassVar[str] = "both"
    NAME: ClassVar[str] = "set_camera"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("camera", "I", 1, 4294967295),
        _f.real("fov_y", 0.0, 3.1),
        _f.real("height", 0.0, 1e12),
        _f.real("near", 0.0, 1e12),
        _f.text("name", 128),
    )
    camera: int = 1
    fov_y: float = 0.0
    height: float = 0.0
    near: float = 0.0
    name: str = ""


@dataclass
class SetEnvironment(Message):
    """edit: light from infinitely far away, all around

    colour: radiance; multiplies the image if there is one
    rotation: turn of the image about +y
    width: texels; 0: no image
    height: texels
    backdrop: 1: the colour is what a ray sees that leaves the scene, from the eye, a mirror or through glass, and
        lights nothing; without an image
    keeps_image: 1: the image stays as it is, or none; width, height and arrays do not count. For daemons that have
        object_get
    display_values: 1: the colours of the scene are a display's values, and light is computed with them as they are:
        pictures of 8 bits show it without a tone map and a transfer function, floats are the light that a display emits
        for it
    arrays: 0: equirectangular image, width x height x 4 half floats (red, green, blue, unused); rows from +y down, the
        middle column is -z
    """
    TYPE: ClassVar[int] = 0x0138
    SENDER: ClassVar[str] = "both"
    NAME: ClassVar[str] = "set_environment"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.real("colour", 0.0, 1e9, 3),
        _f.real("rotation", -100.0, 100.0),
        _f.whole("width", "I", 0, 16384),
        _f.whole("height", "I", 0, 16384),
        _f.whole("backdrop", "I", 0, 1),
        _f.whole("keeps_image", "I", 0, 1),
        _f.whole("display_values", "I", 0, 1),
        _f.array("arrays", BlobRef, 1),
    )
    colour: Sequence[float] = (0.0, 0.0, 0.0)
    rotation: float = 0.0
    width: int = 0
    height: int = 0
    backdrop: int = 0
    keeps_image: int = 0
    display_values: int = 0
    arrays: Sequence[BlobRef] = ()


@dataclass
class SetSkin(Message):
    """edit: nodes that move the vertices of a mesh (joints). It is removed with any of its joints, which is refused
    while a remaining node has the skin

    arrays: 0: joints, 1 u32 each, a node that exists when the transaction is committed; 1: joint_from_mesh, 12 f32
        each, 3x4 row-major: the joint's space from that of the mesh as its vertices are given (glTF's inverse bind
        matrices); missing: identity
    """
    TYPE: ClassVar[int] = 0x0139
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "set_skin"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("skin", "I", 1, 4294967295),
        _f.whole("joint_count", "I", 1, 65536),
        _f.array("arrays", BlobRef, 2),
        _f.text("name", 128),
    )
    skin: int = 1
    joint_count: int = 1
    arrays: Sequence[BlobRef] = ()
    name: str = ""


@dataclass
class SetClip(Message):
    """edit: numbers over time; a job names the clips that it plays. Its channels are removed with it

    arrays: 0: times and values of its channels, f32
    """
    TYPE: ClassVar[int] = 0x013a
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "set_clip"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("clip", "I", 1, 4294967295),
        _f.array("arrays", BlobRef, 1),
        _f.text("name", 128),
    )
    clip: int = 1
    arrays: Sequence[BlobRef] = ()
    name: str = ""


@dataclass
class SetChannel(Message):
    """edit: one animated property of a clip. Translation, rotation or scale of a node without a channel in the playing
    clips come from its transform: translation is its last column, scale the lengths of the others, x negative if it
    mirrors. Of two channels of a clip that change the same property, the greater identifier counts. A channel is
    removed with its clip or its object

    path: determines the kind of `object`
    object: node, light or material; 0 for the view
    width: numbers per value, given by the path
    first_time: index of its key_count times in the clip's array, seconds, ascending; 0 is the beginning of the clip,
        its maximum the end
    first_value: index of its values: width numbers per key, three times that for cubic spline and bezier
    """
    TYPE: ClassVar[int] = 0x013b
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "set_channel"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("channel", "I", 1, 4294967295),
        _f.whole("clip", "I", 1, 4294967295),
        _f.choice("path", ChannelPath),
        _f.whole("object", "I", 0, 4294967295),
        _f.choice("interpolation", Interpolation),
        _f.whole("width", "I", 1, 1024),
        _f.whole("key_count", "I", 1, 16777216),
        _f.whole("first_time", "I", 0, 4294967295),
        _f.whole("first_value", "I", 0, 4294967295),
    )
    channel: int = 1
    clip: int = 1
    path: ChannelPath | str = ChannelPath(0)
    object: int = 0
    interpolation: Interpolation | str = Interpolation(0)
    width: int = 1
    key_count: int = 1
    first_time: int = 0
    first_value: int = 0


@dataclass
class Remove(Message):
    """edit: removes an object; with a node all below it, with a clip its channels, with an object the channels that
    change it, with a joint its skin. Refused if a remaining node still uses it"""
    TYPE: ClassVar[int] = 0x013f
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "remove"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.choice("kind", ObjectKind),
        _f.whole("object", "I", 1, 4294967295),
    )
    kind: ObjectKind | str = ObjectKind(0)
    object: int = 1


@dataclass
class Render(Message):
    """starts a job. Batch: every frame of the range is rendered, in order, and sent on the job's channel within its
    credit; answered by ok after the last frame. View: frames of the newest view_camera are sent within the credit
    and the link's rate, until it is cancelled, or until another render of kind view on its channel replaces it,
    whereupon it is answered by ok; frame numbers continue

    channel: for frames and credit; unused so far, or that of a view which this one replaces
    weight: share of the device's time among the jobs of the client and of its user or key, which has as much as any
        other; 0: 4 for a view, 1 for a batch. Among users and keys it counts as far as the configuration grants
    pass_samples: view: samples that one frame adds while nothing moves, up to `samples`
    adapt: view: 1: quality and size of frames adapt to the link and `frames_per_second` while it moves. A client with a
        margin or hidden_layers makes views of its own, for which a late picture is better than a tiny one. It first
        goes without samples beyond one, then without hidden layers, half of the margin, all of it, then quality; frames
        become smaller only where one would take longer than a quarter of a second. 0: only their rate
    still_encoding: view: of frames while nothing moves; `encoding` is that of motion. jpeg and h264 use its quality, so
        `encoding` must be one of the two as well; lossless ones use the fastest level
    attachments: view: set of bits, 1: depth, 2: normals, 4: sticking, for daemons with that capability; they follow the
        pixels of each frame. Not for batches, which have layers
    credit: frames that may be sent initially; of a view that replaces another: the total since the channel was opened,
        if that is higher
    width: of the picture
    height: of the picture
    samples: per pixel; view: with this number and without changes, no frame is sent
    depth: bounces after the first hit
    seed: same seed, same picture; the noise differs from frame to frame, except with `accumulate`. A view: it differs
        while the view moves and is denoised; at rest the picture is that of the seed
    last_frame: not before the first
    frames_per_second: frame n is n / fps seconds after frame `time_origin_frame`; view: the maximum rate, at which
        `adapt` aims; with a margin it aims at twenty a second at most, as its client makes views in between
    time_origin_frame: the frame at time 0
    tone_map: for rgba8
    exposure_stops: the picture is multiplied by 2 to this power
    quality: of `encoding`; 0: 90 for jpeg, 80 for h264, 1 for the others. JPEG: 100 is the best; zstd and predicted:
        level, at most 19. A lossless `still_encoding` that differs from `encoding` uses its fastest level
    camera_node: for camera path node
    orbit_turn: orbit: angle travelled in `orbit_seconds`, radians
    orbit_seconds: orbit: time for `orbit_turn`
    compare: 1: every wave, also the primary one (which is then traced, not rasterised), is traced by `compare_with` as
        well, and frame_end has the results. The picture is that of `tracer`
    compare_with: for compare: the reference
    compare_far: for compare: two hits are far from each other beyond this share of the scene's diagonal, or of the
        distance if that is longer
    aperture: diameter of the lens, metres; 0: everything is sharp
    focus: distance along the view of the plane in focus, metres; 0: that of the point looked at, or of the scene's
        centre
    shutter: open time of the shutter, from the frame's time on, in frames: 0.5 is the film camera's 180 degrees; 0: no
        motion blur. Nodes and shapes move; camera, lights, materials and visibility are those of the frame's time
    accumulate: Views always add up, if one frame does not have all samples. Daemons of version 0.1.0 refuse `anew`
    ao_distance: ambient occlusion: maximum distance of an occluder, metres; 0: a tenth of the scene's diagonal
    ao_falloff: decrease of an occluder's weight with its distance, as a power of 1 - distance / ao_distance; 0: none
    ao_rays: ambient occlusion: for each sample
    layer_opacity: integrator raycast: opacity of opaque surfaces
    layers: set of layers: bit n stands for the layer of that number; 0: the picture alone. Others need a batch, format
        rgba32f and encoding raw, zstd or predicted
    bvh_form: paper: bounds are spheres, in one order for all directions; rays traverse them two by two
    ldc_resolution: cells along the longest side of the sampled box; auto: 1024, or as many as are worth their time for
        the layers of the scene and the pixels of the picture
    ldc_form: paper: samples are peeled layer by layer, each in one image; minimum and maximum depths of blocks of 8
        texels; a ray hits a sample that it comes as near to as a cell is wide
    abuffer_resolution: texels along a side of the images of the lists; auto: 1280, or as many as are worth their time
        for the layers of the scene and the pixels of the picture
    abuffer_voxels: voxels along a side of the grid, not more than texels; auto: near the root of three times the
        resolution
    abuffer_form: paper: what is inside of a body is told by parity, texel by texel through whole voxels: bodies in
        bodies are missed
    rayspace_mode: what descends beside the hierarchy over the rays
    rayspace_form: paper: flat, bounds are spheres and cones alone, and pairs are brought together 64 at a time, segment
        behind segment
    quadtree_layers: surfaces behind one another that are kept at each texel; auto: 3, but 1 where each is a picture of
        its own that is rendered as a whole, for a lens or for frames between others
    quadtree_resolution: texels along a face of the cube, or along the longer side of the picture; auto: as fine as the
        picture, of a cube two thirds as fine, 256 to 1024
    quadtree_faces: which surfaces are known
    quadtree_pixels: how far a surface may be from where it is, seen by an eye within `quadtree_radius`
    quadtree_radius: of the sphere round the eye within which `quadtree_pixels` holds
    quadtree_margin: of a view, how much more it sees than the picture on each side, as a share of the picture's longer
        side
    quadtree_hits: what a ray hits
    quadtree_form: paper: one layer, planes are hit, and merged within 3 degrees and by bounds that grow with distance
    views_across: in one picture, each of width x height pixels, side by side from the leftmost eye; a frame has
        views_across x width by views_down x height pixels
    views_down: one below the other, from the uppermost eye. View (i, j) is that of an eye moved by ((i - (views_across
        - 1) / 2) x baseline, ((views_down - 1) / 2 - j) x baseline) along the camera's right and up; all look in
        parallel
    baseline: distance between neighbouring eyes, metres; above 0 with several views
    eyes_over: 1: views one below the other are those of eyes side by side, the left one on top; views_across is 1
    view_source: of pictures of several views, through a lens, or between key frames; all others are rendered
    upsample: batch: depth layers are rendered only of frames whose distance from time_origin_frame is a multiple of
        this; each frame is made from those of the nearest, of two the earlier one: it has a camera of its own, and
        shows the scene as that one does. Above 1 it needs view_source layers
    depth_form: view: of the attached depth. inverse: with the step that depth_pixels and depth_radius allow. A frame
        that cannot have it, as it is orthographic or something is nearer than 1 / (65535 depth_step), has metres and
        says so
    depth_pixels: depth_form inverse: so far off at most is where an eye within depth_radius of the frame's sees a
        point, by the rounding of its depth
    depth_radius: of that sphere round the eye. The bound is that of points far from it: of one at the distance d it is
        (1 - depth_radius / d)^-2 times that
    hidden_layers: view: how many frames follow each picture that moves. The first shows, at each pixel, the nearest
        hidden surface that an eye within depth_radius sees past what hides it; the second the next such surface. Where
        there is none the depth is 0. Needs attached depth. They have half of the width and of the height of their
        picture and its margin, rounded up, and the same axis: each pixel stands for two by two. They take at most 15 %
        of the time while cameras come, so that some pictures have none; all of a picture come where no camera comes for
        a tenth of a second
    margin: view: of frames while it moves: share of the width and of the height that the picture is larger by on each
        side, with the field of view that belongs to it; with `adapt` half of that, or nothing, where time or the link
        is short. Above 0, of several views only the one in the middle, from which baseline counts, is sent while it
        moves, and attachments only with it
    parts: view: 1: frames that take the link long come in parts, coarse first, and may end after any. Without the
        capability for that it is as if 0
    background_red: background colour: linear, as a display shows it
    background_green: likewise
    background_blue: likewise
    clamp: distributed and path: what a path brings over a rough surface and at least one more bounce is scaled down to
        this, in the picture's linear values; what one rough surface scatters to the eye stays whole. Behind a rough
        surface no sharper one is seen, by less with every sample. 0: neither
    moving_rate: view: frames a second that are to be rendered while it moves. They go without what the eye misses least
        until they are: samples beyond one, then size, down to a sixth of the width, then bounces beyond two. Frames
        state what they have. At rest it has no effect. 0: nothing is given up for it
    noise: above 0: a tile of the picture gets no more samples once its estimated error is below this, relative to its
        light, and `samples` is the most that one gets. Not with compare, nor with views that are made from layers. 0:
        each pixel gets all samples
    auto_azimuth: camera path auto: where the eye is, from +z (0: the front) about +y towards +x (90)
    auto_elevation: camera path auto: how far the eye is above the horizon; 90: what is seen from above has -z at the
        top
    auto_fov: camera path auto: vertical field of view
    auto_margin: camera path auto: share of the picture that stays free at the edges that what is shown would touch
    auto_zoom: camera path auto: scales the picture about its middle
    auto_node: camera path auto: what is in view, this node and what is below it; 0: the whole scene
    crop_x: batch: frames are this part of the picture alone: columns left of it. Its pixels are those of the whole
        picture. Not with noise, denoise, several views and pictures that are made of layers
    crop_y: rows above it
    crop_width: pixels; 0: frames are the whole picture
    crop_height: pixels
    wireframe: pixels: width of the lines that show, in black, the edges of the triangles that rays of the eye hit
        first; what a tracer stores as samples has none. 0: no lines
    ground: 1: beneath all that is visible, also while clips play, lies a ground that is not seen itself: it shows what
        lies behind it, and where things take light from it, so much less of that. With a transparent background it is
        black, as opaque as that is. Nothing but the eye sees it, from above. Not with view_source layers; the
        integrator raycast, which has no shadows, shows none
    ground_up_x: ground: its normal
    keys: ascending in time
    clips: played simultaneously; of two that change the same property, the later one counts. The paths view-eye,
        view-look-at and view-up need camera path keys
    """
    TYPE: ClassVar[int] = 0x0201
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "render"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("scene", "I", 1, 4294967295),
        _f.choice("kind", JobKind),
        _f.whole("channel", "I", 2, 4294967295),
        _f.whole("weight", "I", 0, 16),
        _f.whole("pass_samples", "I", 1, 256),
        _f.whole("adapt", "I", 0, 1),
        _f.choice("still_encoding", Encoding),
        _f.whole("attachments", "I", 0, 7),
        _f.whole("credit", "I", 0, 65536),
        _f.whole("width", "I", 1, 8192),
        _f.whole("height", "I", 1, 8192),
        _f.whole("samples", "I", 1, 65536),
        _f.whole("depth", "I", 0, 32),
        _f.whole("seed", "Q", 0, 18446744073709551615),
        _f.whole("first_frame", "I", 0, 10000000),
        _f.whole("last_frame", "I", 0, 10000000),
        _f.whole("frame_step", "I", 1, 10000000),
        _f.real("frames_per_second", 0.001, 100000.0),
        _f.whole("time_origin_frame", "I", 0, 10000000),
        _f.choice("tracer", Tracer),
        _f.choice("integrator", Integrator),
        _f.choice("primary", Primary),
        _f.choice("tone_map", ToneMap),
        _f.real("exposure_stops", -64.0, 64.0),
        _f.choice("format", PixelFormat),
        _f.choice("encoding", Encoding),
        _f.whole("quality", "I", 0, 100),
        _f.choice("camera_path", CameraPath),
        _f.whole("camera_node", "I", 0, 4294967295),
        _f.real("orbit_turn", -1e6, 1e6),
        _f.real("orbit_seconds", 0.0, 1e6),
        _f.whole("compare", "I", 0, 1),
        _f.choice("compare_with", Tracer),
        _f.real("compare_far", 1e-9, 1.0),
        _f.real("aperture", 0.0, 1e6),
        _f.real("focus", 0.0, 1e12),
        _f.real("shutter", 0.0, 64.0),
        _f.choice("pixel_filter", PixelFilter),
        _f.choice("accumulate", Accumulation),
        _f.choice("brdf", Brdf),
        _f.real("ao_distance", 0.0, 1e12),
        _f.real("ao_falloff", 0.0, 64.0),
        _f.whole("ao_rays", "I", 1, 256),
        _f.real("layer_opacity", 1e-6, 1.0),
        _f.whole("layers", "I", 0, 268435455),
        _f.choice("bvh_form", TracerForm),
        _f.whole("ldc_resolution", "I", 16, 4096, zero=True),
        _f.choice("ldc_form", TracerForm),
        _f.whole("abuffer_resolution", "I", 16, 4096, zero=True),
        _f.whole("abuffer_voxels", "I", 0, 256, listed=(0, 16, 32, 64, 128, 256)),
        _f.choice("abuffer_form", TracerForm),
        _f.choice("rayspace_mode", RayspaceMode),
        _f.choice("rayspace_form", TracerForm),
        _f.whole("quadtree_layers", "I", 1, 3, zero=True),
        _f.whole("quadtree_resolution", "I", 16, 4096, zero=True),
        _f.choice("quadtree_faces", QuadtreeFaces),
        _f.real("quadtree_pixels", 0.001, 64.0, zero=True),
        _f.real("quadtree_radius", 1e-6, 1e6, zero=True),
        _f.real("quadtree_margin", 0.001, 1.0, zero=True),
        _f.choice("quadtree_hits", QuadtreeHits),
        _f.choice("quadtree_form", TracerForm),
        _f.whole("views_across", "I", 1, 64),
        _f.whole("views_down", "I", 1, 64),
        _f.real("baseline", 0.0, 1e6),
        _f.whole("eyes_over", "I", 0, 1),
        _f.choice("view_source", ViewSource),
        _f.whole("upsample", "I", 1, 64),
        _f.choice("depth_form", DepthForm),
        _f.real("depth_pixels", 0.01, 64.0),
        _f.real("depth_radius", 1e-6, 1e6),
        _f.whole("hidden_layers", "I", 0, 2),
        _f.real("margin", 0.0, 0.5),
        _f.whole("parts", "I", 0, 1),
        _f.choice("background", Background),
        _f.real("background_red", 0.0, 1.0),
        _f.real("background_green", 0.0, 1.0),
        _f.real("background_blue", 0.0, 1.0),
        _f.choice("denoise", Denoise),
        _f.real("clamp", 0.0, 1e6),
        _f.real("moving_rate", 0.0, 1000.0),
        _f.real("noise", 0.0, 1.0),
        _f.real("auto_azimuth", -360.0, 360.0),
        _f.real("auto_elevation", -90.0, 90.0),
        _f.real("auto_fov", 0.1, 177.0),
        _f.real("auto_margin", 0.0, 0.45),
        _f.real("auto_zoom", 0.01, 1000.0),
        _f.whole("auto_node", "I", 0, 4294967295),
        _f.whole("crop_x", "I", 0, 8191),
        _f.whole("crop_y", "I", 0, 8191),
        _f.whole("crop_width", "I", 0, 8192),
        _f.whole("crop_height", "I", 0, 8192),
        _f.real("wireframe", 0.0, 64.0),
        _f.whole("ground", "I", 0, 1),
        _f.real("ground_up_x", -1e6, 1e6),
        _f.real("ground_up_y", -1e6, 1e6),
        _f.real("ground_up_z", -1e6, 1e6),
        _f.array("keys", CameraKey, 1024),
        _f.array("clips", ClipUse, 16),
    )
    scene: int = 1
    kind: JobKind | str = JobKind(0)
    channel: int = 2
    weight: int = 0
    pass_samples: int = 1
    adapt: int = 0
    still_encoding: Encoding | str = Encoding(0)
    attachments: int = 0
    credit: int = 2
    width: int = 1280
    height: int = 720
    samples: int = 1
    depth: int = 8
    seed: int = 0
    first_frame: int = 0
    last_frame: int = 0
    frame_step: int = 1
    frames_per_second: float = 24.0
    time_origin_frame: int = 0
    tracer: Tracer | str = Tracer(0)
    integrator: Integrator | str = Integrator(0)
    primary: Primary | str = Primary(0)
    tone_map: ToneMap | str = ToneMap(0)
    exposure_stops: float = 0.0
    format: PixelFormat | str = PixelFormat(0)
    encoding: Encoding | str = Encoding(0)
    quality: int = 0
    camera_path: CameraPath | str = CameraPath(0)
    camera_node: int = 0
    orbit_turn: float = 0.0
    orbit_seconds: float = 0.0
    compare: int = 0
    compare_with: Tracer | str = Tracer(0)
    compare_far: float = 1e-4
    aperture: float = 0.0
    focus: float = 0.0
    shutter: float = 0.0
    pixel_filter: PixelFilter | str = PixelFilter(0)
    accumulate: Accumulation | str = Accumulation(0)
    brdf: Brdf | str = Brdf(0)
    ao_distance: float = 0.0
    ao_falloff: float = 0.0
    ao_rays: int = 8
    layer_opacity: float = 0.5
    layers: int = 0
    bvh_form: TracerForm | str = TracerForm(0)
    ldc_resolution: int = 0
    ldc_form: TracerForm | str = TracerForm(0)
    abuffer_resolution: int = 0
    abuffer_voxels: int = 0
    abuffer_form: TracerForm | str = TracerForm(0)
    rayspace_mode: RayspaceMode | str = RayspaceMode(0)
    rayspace_form: TracerForm | str = TracerForm(0)
    quadtree_layers: int = 0
    quadtree_resolution: int = 0
    quadtree_faces: QuadtreeFaces | str = QuadtreeFaces(0)
    quadtree_pixels: float = 0.0
    quadtree_radius: float = 0.0
    quadtree_margin: float = 0.0
    quadtree_hits: QuadtreeHits | str = QuadtreeHits(0)
    quadtree_form: TracerForm | str = TracerForm(0)
    views_across: int = 1
    views_down: int = 1
    baseline: float = 0.0
    eyes_over: int = 0
    view_source: ViewSource | str = ViewSource(0)
    upsample: int = 1
    depth_form: DepthForm | str = DepthForm(0)
    depth_pixels: float = 0.25
    depth_radius: float = 0.15
    hidden_layers: int = 0
    margin: float = 0.0
    parts: int = 0
    background: Background | str = Background(0)
    background_red: float = 0.0
    background_green: float = 0.0
    background_blue: float = 0.0
    denoise: Denoise | str = Denoise(0)
    clamp: float = 0.0
    moving_rate: float = 0.0
    noise: float = 0.0
    auto_azimuth: float = 24.0
    auto_elevation: float = 18.0
    auto_fov: float = 40.0
    auto_margin: float = 0.03
    auto_zoom: float = 1.0
    auto_node: int = 0
    crop_x: int = 0
    crop_y: int = 0
    crop_width: int = 0
    crop_height: int = 0
    wireframe: float = 0.0
    ground: int = 0
    ground_up_x: float = 0.0
    ground_up_y: float = 1.0
    ground_up_z: float = 0.0
    keys: Sequence[CameraKey] = ()
    clips: Sequence[ClipUse] = ()


@dataclass
class ViewCamera(Message):
    """the new camera of a view; of several that wait only the newest counts. Not answered: frames name it; a degenerate
    one, or one whose node shows no camera, ends the view with an error. Before the first one a view uses the camera
    of its render, as frame first_frame

    channel: the view's; of one that has ended: ignored
    command: the client's number for it, greater than all earlier ones on the channel
    moving: 1: more will follow soon: frames may be coarser; 0: it rests here for now
    time_s: of the job, for its clips
    eye_world: position
    look_at_world: the point at the centre of the picture
    up_world: not parallel to the view direction
    fov_y: vertical field of view
    node: a node that shows a camera: the view looks through it as it is at time_s, and the previous four fields are
        ignored; 0: they count
    """
    TYPE: ClassVar[int] = 0x0202
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "view_camera"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("channel", "I", 2, 4294967295),
        _f.whole("command", "Q", 1, 18446744073709551615),
        _f.whole("moving", "I", 0, 1),
        _f.real("time_s", -1e6, 1e6),
        _f.real("eye_world", -1e12, 1e12, 3),
        _f.real("look_at_world", -1e12, 1e12, 3),
        _f.real("up_world", -1e6, 1e6, 3),
        _f.real("fov_y", 0.001, 3.1),
        _f.whole("node", "I", 0, 4294967295),
    )
    channel: int = 2
    command: int = 1
    moving: int = 0
    time_s: float = 0.0
    eye_world: Sequence[float] = (0.0, 0.0, 0.0)
    look_at_world: Sequence[float] = (0.0, 0.0, 0.0)
    up_world: Sequence[float] = (0.0, 0.0, 0.0)
    fov_y: float = 0.001
    node: int = 0


@dataclass
class FrameBegin(Message):
    """announces a frame on a job's channel, with the job's request; its bytes follow as frame_data, then frame_end. A
    frame whose request is answered before its end is void

    frame: number in the job's range; of a view: counted from first_frame on
    width: pixels
    height: pixels
    samples: held per pixel; with noise in render: at most
    revision: of the scene that it shows
    size_bytes: of the encoded pixels
    digest: XXH3-64 of the pixels before encoding, seeded with 0; for a lossy encoding, of the encoder's input
    world_from_view: the camera: looks along -z, y up
    fov_y: 0: orthographic
    time_s: of the frame, seconds
    aperture: diameter of the lens, metres
    focus: distance of the plane in focus, metres; 0: there is no lens
    shutter_s: open time of the shutter, seconds
    layers: in the frame, as in render: images of the frame's size and format, stacked in the order of their numbers and
        encoded as one image. The digest covers all
    command: view: the last view_camera that it shows; 0: none yet
    received_ns: when that one arrived, the daemon's clock as in pong; 0: none yet
    applied_ns: when the renderer applied it
    rendered_ns: when the picture was read back
    moving: view: of that command
    key_frame: 1: it can be decoded without earlier ones
    quality: as encoded; 0: lossless
    attachments: that follow the pixels: depth, then normals, each encoded as `predicted`, then sticking, as `zstd`.
        Depth: along the view to the first surface, see depth_form. Normals: 4 u8 per pixel, (n / 2 + 1/2) * 255 in
        world space, then 255; all 0 if there is none. Sticking: u8 per block of 4 x 4 pixels, from the top left, those
        at the right and lower edge of what is left: 0 to 7, sevenths of the share that mirrors, glass and highlights
        have in what is seen there, see above
    depth_bytes: as encoded; they follow the first `size_bytes` of frame_data
    normal_bytes: as encoded; they follow the depth
    depth_form: of the depth; metres if there is none
    depth_step: depth_form inverse: of which 1 / depth is a multiple, 1 / metres; else 0
    margin_x: view: pixels on the left and on the right beyond the picture that was asked for; width, height and fov_y
        are of all
    margin_y: above and below
    hidden_layer: how many surfaces hide what it shows, as in render; width, height, fov_y and margins are its own; 0:
        it is a picture
    of_frame: with a hidden_layer: the picture that it belongs to, whose camera it has; else 0
    sticking_bytes: as encoded; it follows the normals
    depth_less: view: how many bounces it has fewer than render.depth, for moving_rate
    noise: with noise in render: the largest estimated error of a tile; 1e6 while it has fewer than 16 samples; else 0
    """
    TYPE: ClassVar[int] = 0x0210
    SENDER: ClassVar[str] = "server"
    NAME: ClassVar[str] = "frame_begin"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("frame", "I", 0, 4294967295),
        _f.whole("width", "I", 1, 8192),
        _f.whole("height", "I", 1, 8192),
        _f.whole("samples", "I", 1, 4294967295),
        _f.whole("revision", "Q", 0, 18446744073709551615),
        _f.whole("size_bytes", "Q", 0, 4294967296),
        _f.choice("format", PixelFormat),
        _f.choice("encoding", Encoding),
        _f.choice("tracer", Tracer),
        _f.choice("integrator", Integrator),
        _f.whole("digest", "Q", 0, 18446744073709551615),
        _f.real("exposure_stops", -64.0, 64.0),
        _f.real("world_from_view", -1e12, 1e12, 12),
        _f.real("fov_y", 0.0, 3.1),
        _f.real("ortho_height", 0.0, 1e12),
        _f.real("time_s", -1e9, 1e9),
        _f.real("aperture", 0.0, 1e6),
        _f.real("focus", 0.0, 1e12),
        _f.real("shutter_s", 0.0, 1e6),
        _f.whole("layers", "I", 1, 268435455),
        _f.whole("command", "Q", 0, 18446744073709551615),
        _f.whole("received_ns", "Q", 0, 18446744073709551615),
        _f.whole("applied_ns", "Q", 0, 18446744073709551615),
        _f.whole("rendered_ns", "Q", 0, 18446744073709551615),
        _f.whole("moving", "I", 0, 1),
        _f.whole("key_frame", "I", 0, 1),
        _f.whole("quality", "I", 0, 100),
        _f.whole("attachments", "I", 0, 7),
        _f.whole("depth_bytes", "Q", 0, 4294967296),
        _f.whole("normal_bytes", "Q", 0, 4294967296),
        _f.choice("depth_form", DepthForm),
        _f.real("depth_step", 0.0, 1e12),
        _f.whole("margin_x", "I", 0, 4096),
        _f.whole("margin_y", "I", 0, 4096),
        _f.whole("hidden_layer", "I", 0, 2),
        _f.whole("of_frame", "I", 0, 4294967295),
        _f.whole("sticking_bytes", "Q", 0, 4294967296),
        _f.whole("depth_less", "I", 0, 32),
        _f.real("noise", 0.0, 1e6),
    )
    frame: int = 0
    width: int = 1
    height: int = 1
    samples: int = 1
    revision: int = 0
    size_bytes: int = 0
    format: PixelFormat | str = PixelFormat(0)
    encoding: Encoding | str = Encoding(0)
    tracer: Tracer | str = Tracer(0)
    integrator: Integrator | str = Integrator(0)
    digest: int = 0
    exposure_stops: float = 0.0
    world_from_view: Sequence[float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    fov_y: float = 0.0
    ortho_height: float = 0.0
    time_s: float = 0.0
    aperture: float = 0.0
    focus: float = 0.0
    shutter_s: float = 0.0
    layers: int = 1
    command: int = 0
    received_ns: int = 0
    applied_ns: int = 0
    rendered_ns: int = 0
    moving: int = 0
    key_frame: int = 0
    quality: int = 0
    attachments: int = 0
    depth_bytes: int = 0
    normal_bytes: int = 0
    depth_form: DepthForm | str = DepthForm(0)
    depth_step: float = 0.0
    margin_x: int = 0
    margin_y: int = 0
    hidden_layer: int = 0
    of_frame: int = 0
    sticking_bytes: int = 0
    depth_less: int = 0
    noise: float = 0.0


@dataclass
class FrameParts(Message):
    """view: right after the frame_begin of a frame in parts: in which order its bytes follow. Parts of one kind, one
    behind the other, have as many bytes as frame_begin says of it. The first parts are one of colours and, with
    depth, one of coarse depth or depth

    parts: in the order of frame_data, coarse first
    """
    TYPE: ClassVar[int] = 0x0214
    SENDER: ClassVar[str] = "server"
    NAME: ClassVar[str] = "frame_parts"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("frame", "I", 0, 4294967295),
        _f.array("parts", FramePart, 8),
    )
    frame: int = 0
    parts: Sequence[FramePart] = ()


@dataclass
class FrameData(Message):
    """a chunk of the announced frame

    offset_bytes: chunks come in order, without gap
    """
    TYPE: ClassVar[int] = 0x0211
    SENDER: ClassVar[str] = "server"
    NAME: ClassVar[str] = "frame_data"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("offset_bytes", "Q", 0, 4294967296),
        _f.bulk("data", 262144),
    )
    offset_bytes: int = 0
    data: Bytes = b""


@dataclass
class FrameAck(Message):
    """acknowledges the begin and the end of a view's frame; sent at once, twice per frame. The daemon measures latency
    by the first and the link's rate by the time between the two. A client that sends only the second is measured
    less well; one that sends none gets one frame at a time, within its credit

    channel: the view's; of one that has ended: ignored
    whole: 0: its frame_begin; 1: all of it
    want_key_frame: 1: it could not be decoded: the next one must be a key frame
    """
    TYPE: ClassVar[int] = 0x0213
    SENDER: ClassVar[str] = "client"
    NAME: ClassVar[str] = "frame_ack"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("channel", "I", 2, 4294967295),
        _f.whole("frame", "I", 0, 4294967295),
        _f.whole("whole", "I", 0, 1),
        _f.whole("want_key_frame", "I", 0, 1),
    )
    channel: int = 2
    frame: int = 0
    whole: int = 0
    want_key_frame: int = 0


@dataclass
class FrameEnd(Message):
    """the frame is complete, or abandoned; its costs

    secondary_rays: reflection, refraction, passing through
    splits: slices that overflowed their ray buffer and were repeated as halves; nothing is lost
    uploaded_bytes: to the device, for this frame
    structure_bytes: device memory of the acceleration structure
    abandoned: 1: a view's frame that has been overtaken while it was sent: the rest will not follow. One in parts whose
        first parts have come is a coarser answer of the parts that have come whole, uses credit and is acknowledged
        like others. Any other is void, uses no credit and is not acknowledged, and is of a picture at rest or of what
        is hidden
    device_waits: how often the daemon has waited for the device to come to an end with something; software GL is waited
        for at each step, at no cost
    comparisons: for render.compare; ascending by wave and kind
    structure: parts in the order of their numbers; every frame of a tracer has the same names, except those of empty
        parts
    """
    TYPE: ClassVar[int] = 0x0212
    SENDER: ClassVar[str] = "server"
    NAME: ClassVar[str] = "frame_end"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("frame", "I", 0, 4294967295),
        _f.whole("primary_rays", "Q", 0, 18446744073709551615),
        _f.whole("shadow_rays", "Q", 0, 18446744073709551615),
        _f.whole("secondary_rays", "Q", 0, 18446744073709551615),
        _f.whole("splits", "Q", 0, 18446744073709551615),
        _f.whole("uploaded_bytes", "Q", 0, 18446744073709551615),
        _f.whole("structure_bytes", "Q", 0, 18446744073709551615),
        _f.whole("abandoned", "I", 0, 1),
        _f.whole("device_waits", "I", 0, 4294967295),
        _f.array("stages", StageTime, 512),
        _f.array("comparisons", WaveComparison, 128),
        _f.array("structure", StructureRow, 32),
    )
    frame: int = 0
    primary_rays: int = 0
    shadow_rays: int = 0
    secondary_rays: int = 0
    splits: int = 0
    uploaded_bytes: int = 0
    structure_bytes: int = 0
    abandoned: int = 0
    device_waits: int = 0
    stages: Sequence[StageTime] = ()
    comparisons: Sequence[WaveComparison] = ()
    structure: Sequence[StructureRow] = ()


@dataclass
class ImportNote(Message):
    """a note about the model for the user

    where: file, and the place in it
    """
    TYPE: ClassVar[int] = 0x8301
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "import_note"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.choice("severity", Severity),
        _f.text("where", 256),
        _f.text("text", 512),
    )
    severity: Severity | str = Severity(0)
    where: str = ""
    text: str = ""


@dataclass
class ImportClip(Message):
    """an animation clip of the model; its set_clip follows as an edit

    clip: its identifier; 0: it cannot be played
    duration_s: seconds
    """
    TYPE: ClassVar[int] = 0x8302
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "import_clip"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("clip", "I", 0, 4294967295),
        _f.whole("channels", "I", 0, 4294967295),
        _f.real("duration_s", 0.0, 1e9),
        _f.text("name", 128),
    )
    clip: int = 0
    channels: int = 0
    duration_s: float = 0.0
    name: str = ""


@dataclass
class ImportBounds(Message):
    """the box of a mesh or of a set of spheres, at rest and in its own space

    kind: mesh or spheres
    """
    TYPE: ClassVar[int] = 0x8305
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "import_bounds"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.choice("kind", NodeKind),
        _f.whole("object", "I", 1, 4294967295),
        _f.real("lower", -3e38, 3e38, 3),
        _f.real("upper", -3e38, 3e38, 3),
    )
    kind: NodeKind | str = NodeKind(0)
    object: int = 1
    lower: Sequence[float] = (0.0, 0.0, 0.0)
    upper: Sequence[float] = (0.0, 0.0, 0.0)


@dataclass
class ImportProgress(Message):
    """progress of an import

    total_bytes: 0: unknown
    text: the current activity
    """
    TYPE: ClassVar[int] = 0x8303
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "import_progress"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("done_bytes", "Q", 0, 18446744073709551615),
        _f.whole("total_bytes", "Q", 0, 18446744073709551615),
        _f.text("text", 128),
    )
    done_bytes: int = 0
    total_bytes: int = 0
    text: str = ""


@dataclass
class ImportDone(Message):
    """the last message of a successful import, after the answer to its edit_commit

    read_bytes: of files
    read_ns: reading files
    parse_ns: parsing and decoding
    hash_ns: hashing blobs
    total_ns: from the start of main to here
    origin: subtracted from all places of models that are far from the origin; 0: nothing was
    """
    TYPE: ClassVar[int] = 0x8304
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "import_done"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("read_bytes", "Q", 0, 18446744073709551615),
        _f.whole("read_ns", "Q", 0, 18446744073709551615),
        _f.whole("parse_ns", "Q", 0, 18446744073709551615),
        _f.whole("hash_ns", "Q", 0, 18446744073709551615),
        _f.whole("total_ns", "Q", 0, 18446744073709551615),
        _f.real("origin", -1e12, 1e12, 3),
    )
    read_bytes: int = 0
    read_ns: int = 0
    parse_ns: int = 0
    hash_ns: int = 0
    total_ns: int = 0
    origin: Sequence[float] = (0.0, 0.0, 0.0)


@dataclass
class ImportVariant(Message):
    """a variant of the model's materials that the user may choose; in the order of the file"""
    TYPE: ClassVar[int] = 0x8306
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "import_variant"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.text("name", 128),
    )
    name: str = ""


@dataclass
class ImportFile(Message):
    """a file that a model names, whether it is there or not: a buffer, a texture, a library of materials

    model: which of the models that the importer was started for
    name: relative to the model's folder
    """
    TYPE: ClassVar[int] = 0x8307
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "import_file"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("model", "I", 0, 63),
        _f.text("name", 1024),
    )
    model: int = 0
    name: str = ""


@dataclass
class ExportImage(Message):
    """client to exporter: the frame that follows (frame_begin with encoding raw, frame_data, frame_end, all of this
    request) goes into a file; answered by ok once the file is complete, or by error

    half: EXR: 1 stores half floats
    quality: JPEG and WebP
    origin: for the metadata: subtracted from all places of the model; 0: nothing was
    path: PNG, JPEG, EXR, HDR, WebP, TIFF or GIF by its ending; written under a temporary name and renamed
    format: the ending to assume if the path has none; may be empty
    model: for the metadata
    """
    TYPE: ClassVar[int] = 0x8310
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "export_image"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("half", "I", 0, 1),
        _f.whole("quality", "I", 1, 100),
        _f.real("origin", -1e12, 1e12, 3),
        _f.text("path", 4096),
        _f.text("format", 16),
        _f.text("model", 4096),
    )
    half: int = 0
    quality: int = 1
    origin: Sequence[float] = (0.0, 0.0, 0.0)
    path: str = ""
    format: str = ""
    model: str = ""


@dataclass
class ExportName(Message):
    """client to exporter, before an export_image: the name that Cryptomatte layers give an identifier, in all files
    from then on

    kind: node or material
    object: identifier; material 0: the default
    """
    TYPE: ClassVar[int] = 0x8314
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "export_name"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.choice("kind", ObjectKind),
        _f.whole("object", "I", 0, 4294967295),
        _f.text("name", 4096),
    )
    kind: ObjectKind | str = ObjectKind(0)
    object: int = 0
    name: str = ""


@dataclass
class ExportText(Message):
    """client to exporter that was started for it, between export_image and a frame of format rgba8: a line of text to
    be drawn into the frame

    x: of the box in whose middle it is, pixels
    y: of its baseline
    width: of the box: the beginning of a longer text is left out
    colour: red, green and blue as a screen has them, 8 bits each, blue lowest
    """
    TYPE: ClassVar[int] = 0x8313
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "export_text"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("x", "I", 0, 8191),
        _f.whole("y", "I", 0, 8191),
        _f.whole("width", "I", 1, 8192),
        _f.whole("colour", "I", 0, 16777215),
        _f.text("text", 256),
    )
    x: int = 0
    y: int = 0
    width: int = 1
    colour: int = 0
    text: str = ""


@dataclass
class CompareImages(Message):
    """client to exporter: compares two image files that it was allowed to read when it was started; answered by
    images_compared or by error

    ignore_alpha: 1: colours only, so that files with and without alpha can be compared
    threshold: a pixel is beyond it if one of its channels differs by more
    heat_top: the error with the brightest colour; 0: the maximum error, at most 1
    layout: of the picture
    tone_map: by which a screen shows linear files
    a: path
    b: path
    picture: file for the picture of the errors: PNG or JPEG; empty: none
    format: the ending to assume if the picture's path has none; may be empty
    label_a: for layout side; may be empty
    label_b: for layout side; may be empty
    """
    TYPE: ClassVar[int] = 0x8311
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "compare_images"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("ignore_alpha", "I", 0, 1),
        _f.real("threshold", 0.0, 1e9),
        _f.real("heat_top", 0.0, 1e9),
        _f.choice("layout", ComparisonLayout),
        _f.choice("tone_map", ToneMap),
        _f.text("a", 4096),
        _f.text("b", 4096),
        _f.text("picture", 4096),
        _f.text("format", 16),
        _f.text("label_a", 128),
        _f.text("label_b", 128),
    )
    ignore_alpha: int = 0
    threshold: float = 0.0
    heat_top: float = 0.0
    layout: ComparisonLayout | str = ComparisonLayout(0)
    tone_map: ToneMap | str = ToneMap(0)
    a: str = ""
    b: str = ""
    picture: str = ""
    format: str = ""
    label_a: str = ""
    label_b: str = ""


@dataclass
class ImagesCompared(Message):
    """exporter to client: the difference of two images. Errors are differences of one channel, without sign; a pixel
    with NaN or infinity in either image is beyond, and left out of the other figures

    width: pixels
    height: pixels
    channels: that were compared
    space: of the errors
    nonfinite_a: pixels with NaN or infinity
    nonfinite_b: pixels with NaN or infinity
    nonfinite: pixels with NaN or infinity in a or b
    beyond: pixels beyond the threshold
    mean_error: over channels and pixels; greater ones are sent as this limit, here and below
    rms_error: root of the mean square
    shown_rms_error: the same of the red, green and blue that a screen shows
    max_error_x: its column
    max_error_y: its row
    max_error_channel: its channel
    has_ssim: 0: the picture is too small
    ssim: structural similarity of the display values, mean over the picture; 1: identical
    has_butteraugli: 0: the picture is too small or too large
    butteraugli: Butteraugli distance of the display values, 3-norm over the picture; 1: just visible
    butteraugli_max: the maximum distance
    visible: pixels with a distance above 1
    heat_top: the error with the brightest colour in the picture
    picture_width: pixels; 0: no picture was asked for
    picture_height: pixels
    channel_names: such as R,G,B
    """
    TYPE: ClassVar[int] = 0x8312
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "images_compared"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("width", "I", 1, 8192),
        _f.whole("height", "I", 1, 8192),
        _f.whole("channels", "I", 1, 4),
        _f.choice("space", ComparisonSpace),
        _f.whole("nonfinite_a", "Q", 0, 67108864),
        _f.whole("nonfinite_b", "Q", 0, 67108864),
        _f.whole("nonfinite", "Q", 0, 67108864),
        _f.whole("beyond", "Q", 0, 67108864),
        _f.real("mean_error", 0.0, 3e38),
        _f.real("rms_error", 0.0, 3e38),
        _f.real("shown_rms_error", 0.0, 1.0),
        _f.real("max_error", 0.0, 3e38),
        _f.whole("max_error_x", "I", 0, 8191),
        _f.whole("max_error_y", "I", 0, 8191),
        _f.whole("max_error_channel", "I", 0, 3),
        _f.whole("has_ssim", "I", 0, 1),
        _f.real("ssim", -1.0, 1.0),
        _f.whole("has_butteraugli", "I", 0, 1),
        _f.real("butteraugli", 0.0, 3e38),
        _f.real("butteraugli_max", 0.0, 3e38),
        _f.whole("visible", "Q", 0, 67108864),
        _f.real("heat_top", 0.0, 3e38),
        _f.whole("picture_width", "I", 0, 65535),
        _f.whole("picture_height", "I", 0, 65535),
        _f.text("channel_names", 256),
    )
    width: int = 1
    height: int = 1
    channels: int = 1
    space: ComparisonSpace | str = ComparisonSpace(0)
    nonfinite_a: int = 0
    nonfinite_b: int = 0
    nonfinite: int = 0
    beyond: int = 0
    mean_error: float = 0.0
    rms_error: float = 0.0
    shown_rms_error: float = 0.0
    max_error: float = 0.0
    max_error_x: int = 0
    max_error_y: int = 0
    max_error_channel: int = 0
    has_ssim: int = 0
    ssim: float = 0.0
    has_butteraugli: int = 0
    butteraugli: float = 0.0
    butteraugli_max: float = 0.0
    visible: int = 0
    heat_top: float = 0.0
    picture_width: int = 0
    picture_height: int = 0
    channel_names: str = ""


@dataclass
class VideoBegin(Message):
    """client to video writer: the frames that follow (frame_begin with format rgba8 and encoding raw, frame_data,
    frame_end; all of this request, in order, all of one size) become a video; answered by video_begun, or by error
    here or later, after which nothing more of the request is answered and no file is left

    quality: as the constant rate factor of x264, 1 to 51: a lower number is better; of WebP 1 to 100: a higher number
        is better; 0: 18 or 90
    lossless: 1: every pixel as it is; not in MP4 and GIF
    frames_per_second: 23.976 means 24000/1001, likewise 29.97 and so on; in GIF to the nearest hundredth of a second
    path: MP4, MKV, WebP or GIF by its ending; written under a temporary name and renamed
    format: the ending to assume if the path has none; may be empty
    codec: of MP4 and MKV, h264, mpeg4 or ffv1; empty: ffv1 if lossless, else h264 if there is an encoder for it, else
        mpeg4
    model: for the metadata
    """
    TYPE: ClassVar[int] = 0x8320
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "video_begin"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("quality", "I", 0, 100),
        _f.whole("lossless", "I", 0, 1),
        _f.real("frames_per_second", 0.001, 1000.0),
        _f.text("path", 4096),
        _f.text("format", 16),
        _f.text("codec", 32),
        _f.text("model", 4096),
    )
    quality: int = 0
    lossless: int = 0
    frames_per_second: float = 0.001
    path: str = ""
    format: str = ""
    codec: str = ""
    model: str = ""


@dataclass
class VideoBegun(Message):
    """video writer to client: frames may follow

    temporary: name of the unfinished file, in the folder of the path: the client removes it if the writer is killed
    encoder: the library's, such as libx264
    """
    TYPE: ClassVar[int] = 0x8321
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "video_begun"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.text("temporary", 64),
        _f.text("encoder", 32),
    )
    temporary: str = ""
    encoder: str = ""


@dataclass
class VideoEnd(Message):
    """client to video writer: the last frame was sent; one that is incomplete is dropped. Answered by video_written or
    by error

    frames: sent completely
    """
    TYPE: ClassVar[int] = 0x8322
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "video_end"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("frames", "I", 0, 10000001),
    )
    frames: int = 0


@dataclass
class VideoWritten(Message):
    """video writer to client: the file is complete

    width: pixels of the video: even, unless it is lossless, WebP or GIF
    height: pixels
    size_bytes: of the file
    """
    TYPE: ClassVar[int] = 0x8323
    SENDER: ClassVar[str] = "local"
    NAME: ClassVar[str] = "video_written"
    FIELDS: ClassVar[tuple[Field, ...]] = (
        _f.whole("frames", "I", 1, 10000001),
        _f.whole("width", "I", 1, 8192),
        _f.whole("height", "I", 1, 8192),
        _f.whole("size_bytes", "Q", 0, 18446744073709551615),
    )
    frames: int = 1
    width: int = 1
    height: int = 1
    size_bytes: int = 0


_ALL: tuple[type[Message], ...] = (
    Ok, Error, Ping, Pong, Goodbye, Cancel, Credit, Blocked, Stats, StatsReply, SceneOpen, SceneClose, SceneAttach,
    SceneList, SceneListReply, SceneDescribe, SceneDescription, SceneChanged, SceneObjects, SceneObjectsReply,
    ObjectGet, BlobOffer, BlobNeed, BlobData, EditBegin, EditCommit, SetNode, SetMesh, SetSpheres, SetDisc, SetMaterial,
    SetTexture, SetLight, SetCamera, SetEnvironment, SetSkin, SetClip, SetChannel, Remove, Render, ViewCamera,
    FrameBegin, FrameParts, FrameData, FrameAck, FrameEnd, ImportNote, ImportClip, ImportBounds, ImportProgress,
    ImportDone, ImportVariant, ImportFile, ExportImage, ExportName, ExportText, CompareImages, ImagesCompared,
    VideoBegin, VideoBegun, VideoEnd, VideoWritten,
)
MESSAGES = {each.TYPE: each for each in _ALL}


LIMITS = (  # that a daemon sends in the handshake, in their order: name, letter of struct, meaning
    ("queued_output_bytes", "Q", 'bytes that may wait for a client that does not read'),
    ("scene_memory_bytes", "Q", 'memory of a scene, bytes'),
    ("handshake_ms", "I", 'milliseconds for the handshake'),
    ("control_payload_max_bytes", "I", 'payload of a message without bulk data, bytes'),
    ("bulk_chunk_max_bytes", "I", 'bulk data of one message from the daemon, bytes'),
    ("requests_in_flight", "I", 'requests in flight'),
    ("scenes_per_client", "I", 'scenes of a client'),
    ("views_per_client", "I", 'simultaneous jobs of a client'),
    ("nodes_max", "I", 'nodes of a scene'),
    ("texture_edge_max", "I", 'texels along a side of a texture'),
    ("width_max", "I", 'width of a picture, pixels'),
    ("height_max", "I", 'height of a picture, pixels'),
    ("samples_max", "I", 'samples of a pixel'),
    ("idle_seconds", "I", 'seconds of silence; 0: any'),
    ("queued_soft_bytes", "Q", 'output bytes waiting for a client beyond which nothing is read from it'),
    ("device_memory_bytes", "Q", 'memory of the device, bytes; 0: no limit'),
    ("blob_memory_bytes", "Q", 'memory of the blobs of all clients, bytes'),
    ("transaction_memory_bytes", "Q", "memory of the edits of the client's user or key that are not answered yet, bytes"),
    ("frame_memory_bytes", "Q", "memory of the frames of all jobs of the client's user or key, bytes"),
    ("upload_window_bytes", "Q", 'blob data that a client may send ahead, bytes; `credit` counts it'),
    ("frame_window_bytes", "Q", 'frames of a job that wait to be sent, bytes; one frame may always wait'),
    ("queued_soft_ms", "I", 'milliseconds that more than queued_soft_bytes may wait for a client before it is disconnected'),
    ("progress_grace_ms", "I", 'milliseconds in which a message may arrive, whatever its size'),
    ("progress_bytes_per_s", "I", 'minimum bytes per second of a message that takes longer'),
    ("clients_max", "I", 'connected clients'),
    ("unauthenticated_max", "I", 'connections whose handshake is not complete'),
    ("unauthenticated_per_address", "I", 'such connections of one TCP address'),
    ("wrong_key_ms", "I", 'milliseconds before a wrong key is answered'),
    ("wrong_keys_per_minute", "I", 'wrong keys of one network in a minute'),
    ("depth_max", "I", 'depth of the node hierarchy; a root has depth 1'),
    ("blobs_per_client", "I", 'blobs that a connection may name'),
    ("transaction_edits", "I", 'edits of a client that are not answered yet'),
    ("scene_linger_seconds", "I", 'seconds that a kept or shared scene lingers after its last client has left; 0: none'),
    ("scenes_lingering", "I", 'lingering scenes of all clients'),
    ("ldc_memory_bytes", "Q", 'memory, in bytes, of the samples of one layered depth cube, in whole MiB; of more samples the nearest layers are kept, and the frame says so; 0: no limit of its own'),
    ("abuffer_memory_bytes", "Q", 'memory, in bytes, of the lists of the tracer abuffer, in whole MiB; a scene that needs more is refused; 0: no limit of its own'),
    ("ldc_layers_max", "I", 'Layers of a layered depth cube; of more the nearest are kept, and the frame says so'),
)
