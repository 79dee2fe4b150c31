# farlight. `make help` lists the targets.
#
# config=debug|release|sanitize|coverage|fuzz chooses the flags and the folder below build/.
# Sources are found by folder: a new .c file needs no line here.

config ?= release
B := build/$(config)
VERSION := $(shell sed -n 's/^.define FARLIGHT_VERSION "\(.*\)"/\1/p' protocol/version.h)
PREFIX ?= /usr/local
# Where packages want the library and systemd's units.
LIBDIR ?= $(PREFIX)/lib
UNITDIR ?= $(PREFIX)/lib/systemd/system
DESTDIR ?=
PKG_CONFIG ?= pkg-config
# Make's own defaults are cc and g++; what the user says wins.
ifeq ($(origin CC),default)
CC := gcc
endif

WARN := -Wall -Wextra -Werror -Wconversion -Wshadow
WARN_C := $(WARN) -Wstrict-prototypes -Wmissing-prototypes
CPPFLAGS_ALL := -D_GNU_SOURCE -I.
CFLAGS_ALL := -std=c17 -fno-common -fvisibility=hidden -pthread -MMD -MP
CXXFLAGS_ALL := -std=c++17 -fvisibility=hidden -pthread -MMD -MP
LDFLAGS_ALL := -pthread

# -g1 is what traces of calls and profiles need. -g adds variables, which config=debug has, for a fifth of the time to compile.
ifeq ($(config),debug)
OPT := -O0 -g3 -DFARLIGHT_DEBUG
else ifeq ($(config),release)
OPT := -O2 -g1 -fno-math-errno -fno-trapping-math
else ifeq ($(config),sanitize)
OPT := -O1 -g1 -DFARLIGHT_DEBUG -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer
LDFLAGS_ALL += -fsanitize=address,undefined
else ifeq ($(config),coverage)
OPT := -O0 -g --coverage -fprofile-update=atomic
LDFLAGS_ALL += --coverage
else ifeq ($(config),fuzz)
CC := clang
CXX := clang++
OPT := -O1 -g1 -fsanitize=address,undefined,fuzzer-no-link -fno-sanitize-recover=undefined -fno-omit-frame-pointer
LDFLAGS_ALL += -fsanitize=address,undefined
else
$(error config=$(config) is not one of debug, release, sanitize, coverage, fuzz)
endif

# The tracer `reference` is Embree: built in where its header is found. EMBREE=0 leaves it out.
ifeq ($(origin EMBREE),undefined)
EMBREE := $(if $(shell printf '\#include <embree3/rtcore.h>' | $(CC) $(CPPFLAGS) -E -x c - >/dev/null 2>&1 && echo 1),1,0)
endif

# Linked libraries, by program.
SERVER_PKGS := epoxy egl libzstd libsodium libxxhash libturbojpeg inih cglm libseccomp
# Its allocator (server/base/allocator.c), but where the sanitizers have theirs.
SERVER_PKGS += $(if $(filter sanitize fuzz,$(config)),,jemalloc)
# The daemon loads this one when it needs it, so that only its headers are needed here.
SERVER_LOADED_PKGS := libavcodec libavutil
CLIENT_PKGS := libzstd libsodium libxxhash libturbojpeg jansson
IMPORT_PKGS := tinygltf tinyobjloader draco jansson libsodium libseccomp libpng libturbojpeg stb
TEXTURE_PKGS := OpenImageIO
ASSIMP_PKGS := assimp
EXPORT_PKGS := libpng libturbojpeg libexif OpenEXR libseccomp
IMAGES_PKGS := OpenImageIO libtiff-4 libjxl
VIDEO_PKGS := libavformat libavcodec libavutil libseccomp
PALETTE_PKGS := libavfilter libavutil
WEB_PKGS := libwebsockets
VIEWER_PKGS := sdl2 SDL2_ttf libavcodec libswscale libavutil
TEST_PKGS := cmocka
# pkg-config is only asked when something is built.
pkg_cflags = $(shell $(PKG_CONFIG) --cflags $(1) 2>/dev/null)
pkg_libs = $(shell $(PKG_CONFIG) --libs $(1) 2>/dev/null)

# All files of a kind below a folder, at any depth: $(call sources,FOLDER,c h).
sources = $(sort $(foreach ending,$(2),$(shell find $(1) -name '*.$(ending)')))

# ---- sources ---------------------------------------------------------------------------------------
# Sealed connections are for the daemon and the library alone: helper programs go without libsodium.
SEALED_SRC := $(call sources,protocol/sealed,c)
DOCS_SRC := $(call sources,protocol/docs,c)
# Forms of pixels, one of them packed with libzstd: likewise.
PIXELS_SRC := $(call sources,protocol/pixels,c)
# What both sides need beside messages.
COMMON_SRC := $(call sources,protocol/common,c)
PROTOCOL_SRC := $(filter-out $(DOCS_SRC) $(SEALED_SRC) $(PIXELS_SRC) $(COMMON_SRC),$(call sources,protocol,c))
SERVER_SRC := $(filter-out server/main.c,$(call sources,server,c))
ifneq ($(EMBREE),1)
SERVER_SRC := $(filter-out server/trace/reference/%,$(SERVER_SRC))
endif
LIB_SRC := $(call sources,client/lib,c)
WARP_SRC := $(call sources,client/warp,c)
EDIT_SRC := $(call sources,client/edit,c)
CLI_SRC := $(call sources,client/cli,c)
IMPORT_C := $(call sources,client/import,c)
# Modules of the helper programs need hundreds of libraries, and are loaded only when they are used.
TEXTURE_CXX := client/import/image/module.cpp
ASSIMP_CXX := client/import/assimp/module.cpp
IMPORT_CXX := $(filter-out $(TEXTURE_CXX) $(ASSIMP_CXX),$(call sources,client/import,cpp))
EXPORT_C := $(call sources,client/output,c)
# It includes the others of its folder.
IMAGES_CXX := client/output/library/module.cpp
EXPORT_CXX := $(filter-out client/output/library/%,$(call sources,client/output,cpp))
PALETTE_C := client/video/palette_library.c
VIDEO_C := $(filter-out $(PALETTE_C),$(call sources,client/video,c))
VIEWER_C := $(call sources,client/viewer,c)
WEB_C := $(call sources,client/web,c)
SHADERS := $(patsubst shaders/%,%,$(call sources,shaders,h glsl comp vert geom frag))

# V=1 shows the commands.
ifeq ($(V),)
say = @printf '  %-5s %s\n' $(1) $@;
else
say =
endif

obj = $(patsubst %.c,$(B)/%.o,$(patsubst %.cpp,$(B)/%.opp,$(1)))
PROTOCOL_OBJ := $(call obj,$(PROTOCOL_SRC))
SEALED_OBJ := $(call obj,$(SEALED_SRC))
PIXELS_OBJ := $(call obj,$(PIXELS_SRC))
COMMON_OBJ := $(call obj,$(COMMON_SRC))
SERVER_OBJ := $(call obj,$(SERVER_SRC)) $(B)/shader_sources.o $(SEALED_OBJ) $(PIXELS_OBJ) $(COMMON_OBJ)
WARP_OBJ := $(call obj,$(WARP_SRC))
LIB_OBJ := $(call obj,$(LIB_SRC) $(EDIT_SRC)) $(WARP_OBJ) $(SEALED_OBJ) $(PIXELS_OBJ) $(COMMON_OBJ)
CLI_OBJ := $(call obj,$(CLI_SRC))
# What programs share is linked to each of them, as an archive: each takes what it needs. Tests link the windows' and pages' parts so, too.
HELPER_OBJ := $(call obj,$(call sources,client/helper,c))
OPTIONS_OBJ := $(call obj,$(call sources,client/options,c))
VIEWER_OBJ := $(call obj,$(VIEWER_C))
WEB_OBJ := $(call obj,$(WEB_C))
IMPORT_OBJ := $(call obj,$(IMPORT_C) $(IMPORT_CXX)) $(COMMON_OBJ) $(B)/helper.a
EXPORT_OBJ := $(call obj,$(EXPORT_C) $(EXPORT_CXX)) $(B)/helper.a
VIDEO_OBJ := $(call obj,$(VIDEO_C) client/lib/rate.c protocol/pixels/ycbcr.c) $(B)/helper.a

# The library for others' programs: only what farlight.h declares is visible.
SONAME := libfarlight.so.$(firstword $(subst ., ,$(VERSION)))
# farlight.h is installed as <farlight/client.h>, the others below farlight/.
PUBLIC_HEADERS := client/lib/farlight.h client/warp/warp.h $(addprefix protocol/,messages.h messages.def tracers.h tracers.def words.h words.def)
SHARED_OBJ := $(LIB_OBJ) $(PROTOCOL_OBJ)

# The Python package: links to its sources, beside what is generated.
PYTHON_SRC := $(wildcard client/python/farlight/*.py) client/python/farlight/py.typed client/python/pyproject.toml client/python/README.md
PYTHON_PACKAGE := $(patsubst client/python/%,$(B)/python/%,$(PYTHON_SRC)) $(B)/python/farlight/messages.py

MODULES_OBJ := $(call obj,$(TEXTURE_CXX) $(ASSIMP_CXX) $(IMAGES_CXX) $(PALETTE_C))
MODULES := $(B)/farlight-textures.so $(B)/farlight-assimp.so $(B)/farlight-images.so $(B)/farlight-palette.so
PROGRAMS := $(B)/farlightd $(B)/farlight $(B)/farlight-import $(B)/farlight-export $(B)/farlight-video $(B)/farlight-view $(B)/farlight-web

.PHONY: all
all: $(PROGRAMS) $(MODULES) $(B)/$(SONAME) $(B)/libfarlight.a $(B)/protocol.md $(B)/shot.schema.json $(B)/man/farlight.1 $(PYTHON_PACKAGE)
ifneq ($(EMBREE),1)
	@echo 'built without Embree: the tracer reference is left out (its header is in the package libembree-dev)'
endif

$(B)/server/%.o: INCLUDES = -Iserver -Ishaders $(SERVER_CFLAGS)
# The table of the tracers takes what is linked; it is made again when that changes, and with it all that links it.
EMBREE_STAMP := $(B)/embree-$(EMBREE)
$(EMBREE_STAMP):
	@mkdir -p $(B) && rm -f $(B)/embree-[01] && touch $@
$(B)/server/trace/tracer.o: $(EMBREE_STAMP)
$(B)/shader_sources.o: INCLUDES = -Iserver
$(B)/client/%.o: INCLUDES = -Iclient $(CLIENT_CFLAGS)
# Loops over lanes (client/warp/lanes.h) become vector instructions with -O3; with -O2 a view takes several times as long.
# Without contraction all processors have the same results. clang says which loops it leaves as they are.
$(B)/client/warp/%.o: CPPFLAGS_ALL += -Ishaders
$(B)/client/warp/%.o: CFLAGS_ALL += -fopenmp-simd -ffp-contract=off -Wno-pass-failed $(if $(filter release,$(config)),-O3 -DLANES_CLONES)
$(B)/client/import/%.opp $(B)/client/import/%.o: INCLUDES = -Iclient $(IMPORT_CFLAGS)
$(B)/client/output/%.opp $(B)/client/output/%.o: INCLUDES = -Iclient $(EXPORT_CFLAGS)
$(B)/client/video/%.o: INCLUDES = -Iclient $(VIDEO_CFLAGS)
$(B)/client/viewer/%.o: INCLUDES = -Iclient $(CLIENT_CFLAGS) $(VIEWER_CFLAGS)
$(B)/tests/%.o: INCLUDES = -Iserver -Ishaders -Iclient $(SERVER_CFLAGS) $(CLIENT_CFLAGS) $(TEST_CFLAGS)
SERVER_CFLAGS = $(eval SERVER_CFLAGS := $(call pkg_cflags,$(SERVER_PKGS) $(SERVER_LOADED_PKGS)))$(SERVER_CFLAGS)
CLIENT_CFLAGS = $(eval CLIENT_CFLAGS := $(call pkg_cflags,$(CLIENT_PKGS)))$(CLIENT_CFLAGS)
TEST_CFLAGS = $(eval TEST_CFLAGS := $(call pkg_cflags,$(TEST_PKGS)))$(TEST_CFLAGS)
# Others' C++ headers are system headers: our warnings are for our own files.
IMPORT_CFLAGS = $(eval IMPORT_CFLAGS := $(patsubst -I%,-isystem %,$(call pkg_cflags,$(IMPORT_PKGS) $(TEXTURE_PKGS) $(ASSIMP_PKGS))))$(IMPORT_CFLAGS)
VIDEO_CFLAGS = $(eval VIDEO_CFLAGS := $(patsubst -I%,-isystem %,$(call pkg_cflags,$(VIDEO_PKGS))))$(VIDEO_CFLAGS)
VIEWER_CFLAGS = $(eval VIEWER_CFLAGS := $(patsubst -I%,-isystem %,$(call pkg_cflags,$(VIEWER_PKGS))))$(VIEWER_CFLAGS)
EXPORT_CFLAGS = $(eval EXPORT_CFLAGS := $(patsubst -I%,-isystem %,$(call pkg_cflags,$(EXPORT_PKGS) $(IMAGES_PKGS))))$(EXPORT_CFLAGS)

$(B)/%.o: %.c
	@mkdir -p $(@D)
	$(call say,CC)$(CC) $(CPPFLAGS_ALL) $(INCLUDES) $(OPT) $(CFLAGS_ALL) $(POSITION) $(WARN_C) $(CPPFLAGS) $(CFLAGS) -c $< -o $@
$(B)/%.opp: %.cpp
	@mkdir -p $(@D)
	$(call say,CXX)$(CXX) $(CPPFLAGS_ALL) $(INCLUDES) $(OPT) $(CXXFLAGS_ALL) $(POSITION) $(WARN) $(CPPFLAGS) $(CXXFLAGS) -c $< -o $@

# What libraries are linked of is compiled once, for them and for programs. No program replaces functions of the library, so that
# its files call their own as those of a program do. Its map of symbols chooses among what is visible.
$(SHARED_OBJ) $(MODULES_OBJ): POSITION := -fPIC -fno-semantic-interposition
$(filter $(B)/protocol/% $(B)/client/warp/%,$(SHARED_OBJ)): POSITION += -fvisibility=default
$(B)/$(SONAME): $(SHARED_OBJ) client/lib/libfarlight.map
	$(call say,LINK)$(CC) -shared -Wl,-soname,$(SONAME) -Wl,--version-script=client/lib/libfarlight.map $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) \
	    $(SHARED_OBJ) $(CLIENT_LIBS) -o $@
# One object whose symbols are those of the shared library, so that no name of ours meets one of the program's.
$(B)/libfarlight.a: $(SHARED_OBJ) client/lib/libfarlight.map
	@rm -f $@
	$(call say,AR)sed -n '/^global:/,/^local:/s/^ *\(.*\);$$/\1/p' client/lib/libfarlight.map >$(B)/libfarlight.symbols && \
	    ld -r $(SHARED_OBJ) -o $(B)/libfarlight.o && \
	    objcopy --localize-hidden -w --keep-global-symbols=$(B)/libfarlight.symbols $(B)/libfarlight.o && \
	    ar rcs $@ $(B)/libfarlight.o

$(B)/shader_sources.c: shaders/embed.sh $(addprefix shaders/,$(SHADERS)) Makefile
	@mkdir -p $(@D)
	shaders/embed.sh $(CURDIR)/shaders $(SHADERS) >$@.new && mv $@.new $@
$(B)/shader_sources.o: $(B)/shader_sources.c
	$(call say,CC)$(CC) $(CPPFLAGS_ALL) $(INCLUDES) $(OPT) $(CFLAGS_ALL) $(WARN_C) $(CPPFLAGS) $(CFLAGS) -c $< -o $@

# ---- programs --------------------------------------------------------------------------------------
EMBREE_LIBS := $(if $(filter 1,$(EMBREE)),-lembree3)
SERVER_LIBS = $(call pkg_libs,$(SERVER_PKGS)) $(EMBREE_LIBS) -lm
CLIENT_LIBS = $(call pkg_libs,$(CLIENT_PKGS)) -lm
# meshoptimizer comes without a file for pkg-config.
IMPORT_LIBS = $(call pkg_libs,$(IMPORT_PKGS)) -lmeshoptimizer -lexpat -lminizip -lm
EXPORT_LIBS = $(call pkg_libs,$(EXPORT_PKGS)) -lm
VIDEO_LIBS = $(call pkg_libs,$(VIDEO_PKGS)) -lm
VIEWER_LIBS = $(call pkg_libs,$(VIEWER_PKGS) $(CLIENT_PKGS)) -lm
WEB_LIBS = $(call pkg_libs,$(WEB_PKGS) $(CLIENT_PKGS)) -lm

$(B)/farlightd: $(B)/server/main.o $(SERVER_OBJ) $(PROTOCOL_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) $^ $(SERVER_LIBS) -o $@
$(B)/farlight: $(CLI_OBJ) $(B)/options.a $(LIB_OBJ) $(PROTOCOL_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) $^ $(CLIENT_LIBS) -o $@
$(B)/helper.a: $(HELPER_OBJ)
$(B)/options.a: $(OPTIONS_OBJ)
$(B)/viewer.a: $(filter-out %/main.o,$(VIEWER_OBJ))
$(B)/web.a: $(filter-out %/main.o,$(WEB_OBJ))
$(addprefix $(B)/,helper.a options.a viewer.a web.a):
	$(call say,AR)rm -f $@ && $(AR) rcs $@ $^
$(B)/farlight-import: $(IMPORT_OBJ) $(PROTOCOL_OBJ) | $(B)/farlight-textures.so $(B)/farlight-assimp.so
	$(call say,LINK)$(CXX) $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) $^ $(IMPORT_LIBS) -o $@
$(B)/farlight-textures.so: $(call obj,$(TEXTURE_CXX))
	$(call say,LINK)$(CXX) -shared $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) $^ $(call pkg_libs,$(TEXTURE_PKGS)) -o $@
$(B)/farlight-assimp.so: $(call obj,$(ASSIMP_CXX))
	$(call say,LINK)$(CXX) -shared $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) $^ $(call pkg_libs,$(ASSIMP_PKGS)) -o $@
$(B)/farlight-export: $(EXPORT_OBJ) $(PROTOCOL_OBJ) | $(B)/farlight-images.so
	$(call say,LINK)$(CXX) $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) $^ $(EXPORT_LIBS) -o $@
$(B)/farlight-images.so: $(call obj,$(IMAGES_CXX))
	$(call say,LINK)$(CXX) -shared $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) $^ $(call pkg_libs,$(IMAGES_PKGS)) -o $@
$(B)/farlight-palette.so: $(call obj,$(PALETTE_C))
	$(call say,LINK)$(CC) -shared $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) $^ $(call pkg_libs,$(PALETTE_PKGS)) -o $@
$(B)/farlight-video: $(VIDEO_OBJ) $(PROTOCOL_OBJ) | $(B)/farlight-palette.so
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) $^ $(VIDEO_LIBS) -o $@
$(B)/farlight-view: $(B)/client/viewer/main.o $(B)/viewer.a $(B)/options.a $(LIB_OBJ) $(PROTOCOL_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) $^ $(VIEWER_LIBS) -o $@
$(B)/farlight-web: $(B)/client/web/main.o $(B)/web.a $(B)/options.a $(LIB_OBJ) $(PROTOCOL_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) $^ $(WEB_LIBS) -o $@
# It takes in the files of the page.
$(B)/client/web/page.o: $(wildcard client/web/page/*)
$(B)/protocol-docgen: $(call obj,$(DOCS_SRC)) $(PROTOCOL_OBJ) $(SEALED_OBJ) $(COMMON_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $^ $(call pkg_libs,libsodium libxxhash) -o $@
$(B)/protocol.md: $(B)/protocol-docgen protocol/docs/guide.md
	$^ >$@.new && mv $@.new $@

$(B)/python/%: client/python/%
	@mkdir -p $(@D)
	@ln -srf $< $@
# With the package's version.py.
$(B)/python/farlight/messages.py: client/python/generate.py $(wildcard client/python/farlight/*.py protocol/*.def) protocol/version.h
	@mkdir -p $(@D)
	$(call say,GEN)CC='$(CC)' python3 $< $(@D)

# What the tables say of tracers and options, in the place of the line that asks for it.
$(B)/shot.schema.json: client/cli/shot/shot.schema.json $(B)/farlight
	$(B)/farlight tracers --schema >$@.part && sed -e '/@SETTINGS@/{r $@.part' -e 'd;}' $< >$@.new && mv $@.new $@
$(B)/man/farlight.1: conf/man/farlight.1 $(B)/farlight
	@mkdir -p $(@D)
	$(B)/farlight tracers --manual >$@.part && sed -e '/@TRACERS@/{r $@.part' -e 'd;}' $< >$@.new && mv $@.new $@

# ---- tests -----------------------------------------------------------------------------------------
# Tests register themselves (tests/harness/test.h). Those that need neither libraries nor functions replaced for them alone are
# one program; run_tests.py runs each of its files in a process of its own.
MEDIA_TEST_SRC := $(call sources,tests/unit/encode tests/unit/viewer,c)
FAULT_TEST_SRC := tests/unit/session/faults.c
CORPUS_TEST_SRC := $(call sources,tests/unit/fuzz,c)
UNIT_TEST_SRC := $(filter-out $(MEDIA_TEST_SRC) $(FAULT_TEST_SRC) $(CORPUS_TEST_SRC),$(call sources,tests/unit tests/accuracy,c))
TEST_PROGRAMS := $(addprefix $(B)/tests/unit/,unit_tests media_tests fault_tests corpus_tests)
TEST_LIBS = $(call pkg_libs,$(TEST_PKGS) $(SERVER_PKGS) $(CLIENT_PKGS)) $(EMBREE_LIBS) -lm
# With the optimiser they take longer to compile than it saves when they run, but for brute force over triangles.
ifneq ($(filter release sanitize,$(config)),)
$(call obj,$(filter-out tests/unit/trace/%,$(call sources,tests/unit tests/accuracy tests/harness tests/tracers,c))): OPT += -O0
endif
$(TEST_PROGRAMS): $(B)/tests/harness/main.o $(SERVER_OBJ) $(PROTOCOL_OBJ) $(LIB_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $^ $(TEST_LIBS) -o $@
$(B)/tests/unit/unit_tests: $(call obj,$(UNIT_TEST_SRC))
$(B)/tests/unit/media_tests: $(call obj,$(MEDIA_TEST_SRC))
$(B)/tests/unit/fault_tests: $(call obj,$(FAULT_TEST_SRC))
$(B)/tests/unit/corpus_tests: $(call obj,$(CORPUS_TEST_SRC))
# What every tracer promises: one program of a folder, with the rows of all tracers.
CONTRACT := $(B)/tests/tracers/test_contract
CONTRACT_OBJ := $(call obj,$(filter-out tests/tracers/test_%,$(wildcard tests/tracers/*.c)))
$(CONTRACT): %: %.o $(CONTRACT_OBJ) $(SERVER_OBJ) $(PROTOCOL_OBJ) $(LIB_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $^ $(TEST_LIBS) -o $@
MODEL_OBJ := $(B)/tests/fixtures/load_model.o
# Sessions live in a time of their own.
SERVING_OBJ := $(call obj,$(addprefix tests/fuzz/,engine_recorder.c serving.c))
SERVING_WRAP := -Wl,--wrap=clock_now_ns
# Each fuzzer under a name of its own.
KEPT_OBJ := $(patsubst tests/fuzz/fuzz_%.c,$(B)/tests/fuzz/kept_%.o,$(wildcard tests/fuzz/fuzz_*.c))
$(B)/tests/fuzz/kept_%.o: CPPFLAGS_ALL += -DLLVMFuzzerTestOneInput=fuzz_one_$*
$(B)/tests/fuzz/kept_%.o: tests/fuzz/fuzz_%.c
	@mkdir -p $(@D)
	$(call say,CC)$(CC) $(CPPFLAGS_ALL) $(INCLUDES) $(OPT) $(CFLAGS_ALL) $(WARN_C) $(CPPFLAGS) $(CFLAGS) -c $< -o $@
# The importer without its main() and its sandbox, with its modules as they are compiled for themselves.
READERS_OBJ := $(filter-out $(addprefix $(B)/client/import/,main.o send.o),$(IMPORT_OBJ)) $(call obj,$(TEXTURE_CXX) $(ASSIMP_CXX))
READERS_LIBS = $(IMPORT_LIBS) $(call pkg_libs,$(TEXTURE_PKGS) $(ASSIMP_PKGS))
# Sessions that begin, break and end, with memory that runs out.
$(B)/tests/unit/fault_tests: $(SERVING_OBJ) $(B)/tests/fuzz/recorded_session.o
$(B)/tests/unit/fault_tests: TEST_LIBS += $(SERVING_WRAP) -Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc
# What the fuzzers have found.
$(B)/tests/unit/corpus_tests: $(KEPT_OBJ) $(SERVING_OBJ) $(READERS_OBJ) $(B)/web.a
$(B)/tests/unit/corpus_tests: TEST_LIBS += $(SERVING_WRAP) $(READERS_LIBS) -lstdc++
# What the daemon encodes is decoded by the library itself.
$(B)/tests/unit/media_tests: $(B)/viewer.a $(B)/options.a
$(B)/tests/unit/media_tests: TEST_LIBS += $(VIEWER_LIBS) -Wl,--wrap=libav_load
$(B)/tests/unit/unit_tests: TEST_LIBS += $(call pkg_libs,libseccomp) $(SERVING_WRAP)
$(B)/tests/unit/unit_tests: $(B)/client/helper/sandbox.o $(B)/client/import/model/closed.o $(B)/web.a $(B)/options.a $(MODEL_OBJ) $(B)/tests/fixtures/frame_hooks.o
# Measurements of the benchmark register themselves (tests/bench/bench.h).
BENCH_SRC := $(filter-out tests/bench/shaped_link.c,$(wildcard tests/bench/*.c))
BENCH_PROGRAM := $(B)/tests/bench/bench
$(BENCH_PROGRAM): $(call obj,$(BENCH_SRC)) $(B)/viewer.a $(MODEL_OBJ) $(SERVER_OBJ) $(PROTOCOL_OBJ) $(LIB_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $^ $(TEST_LIBS) $(VIEWER_LIBS) -o $@
# A link to look over.
SHAPED_LINK := $(B)/tests/bench/shaped_link
$(SHAPED_LINK): %: %.o
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $^ -o $@

# The generator of the bundled scenes.
TOOLS_OBJ := $(patsubst %,$(B)/tests/tools/%.o,make_scenes animated_scene animated_parts gltf_writer glb shape)
$(B)/tests/tools/make_scenes: $(TOOLS_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $^ -lm -o $@

# Where a model is at a time of a clip, as the daemon has it.
$(B)/tests/tools/pose_dump: $(B)/tests/tools/pose_dump.o $(MODEL_OBJ) $(SERVER_OBJ) $(PROTOCOL_OBJ) $(LIB_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $^ $(TEST_LIBS) -o $@

# A daemon that loses its GPU when a test says so.
LOSING_DAEMON := $(B)/tests/tools/farlightd_losing
$(LOSING_DAEMON): $(B)/tests/tools/lost_gpu.o $(B)/server/main.o $(SERVER_OBJ) $(PROTOCOL_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $(LDFLAGS) $^ $(SERVER_LIBS) -o $@

# ---- what people call ------------------------------------------------------------------------------
BUILD_PACKAGES := gcc g++ make pkg-config libepoxy-dev libegl-dev libgl-dev libcglm-dev libturbojpeg0-dev libzstd-dev \
    libsodium-dev libxxhash-dev libinih-dev libjansson-dev libjemalloc-dev libseccomp-dev libopenimageio-dev libpng-dev libtiff-dev libexif-dev libopenexr-dev libjxl-dev libtinygltf-dev \
    libtinyobjloader-dev libdraco-dev libmeshoptimizer-dev libstb-dev libassimp-dev libexpat1-dev libminizip-dev libembree-dev libavcodec-dev libavformat-dev libavfilter-dev libavutil-dev libswscale-dev libsdl2-dev libsdl2-ttf-dev libwebsockets-dev fonts-dejavu-core libegl1 libgl1-mesa-dri python3
TEST_PACKAGES := libcmocka-dev python3-jsonschema python3-yaml python3-numpy python3-prometheus-client ffmpeg xvfb gnuplot-nox
LINT_PACKAGES := clang clang-format glslang-tools python3-numpy mypy
# A second driver stack: OpenGL over Vulkan, on the CPU. The validation sees what it does.
STACK_PACKAGES := mesa-vulkan-drivers
SYNC_PACKAGES := $(STACK_PACKAGES) libvulkan1 libvulkan-dev vulkan-validationlayers
ANALYZE_PACKAGES := clang clang-tidy
COVERAGE_PACKAGES := gcovr
FUZZ_PACKAGES := clang libclang-rt-14-dev
# These come for Debian's own python3.
FIDELITY_PACKAGES := python3-openimageio python3-numpy
EQUAL_TIME_PACKAGES := $(FIDELITY_PACKAGES) blender
DEB_PACKAGES := debhelper dh-python dpkg-dev fakeroot lintian xz-utils git
WEB_PACKAGES := chromium python3-websocket
FARM_PACKAGES := slurm-wlm slurmdbd mariadb-server-core mariadb-client-core nodejs python3-yaml
BLENDER_PACKAGES := blender python3-numpy xvfb xauth

.PHONY: tests tests-all build-packages test-packages stack-packages sync-packages lint-packages analyze-packages coverage-packages fuzz-packages fidelity-packages equal-time-packages farm-packages web-packages deb-packages blender-packages test test-part test-all test-zink check-sync demo bench fidelity equal-time soak farm-drill farm-test web-test blender-test blender-addon siege bench-plot check-headers check-rules lint check analyze coverage format install uninstall dist deb deb-same deb-test container-test clean distclean help
tests: $(TEST_PROGRAMS) $(CONTRACT) $(B)/tests/tools/make_scenes $(B)/tests/tools/pose_dump $(LOSING_DAEMON)
# With the benchmark, whose own tests need it.
tests-all: tests $(BENCH_PROGRAM) $(SHAPED_LINK)

build-packages:
	@tests/tools/install_packages.sh $(BUILD_PACKAGES)
test-packages:
	@tests/tools/install_packages.sh $(BUILD_PACKAGES) $(TEST_PACKAGES)
stack-packages:
	@tests/tools/install_packages.sh $(BUILD_PACKAGES) $(TEST_PACKAGES) $(STACK_PACKAGES)
sync-packages:
	@tests/tools/install_packages.sh $(BUILD_PACKAGES) $(TEST_PACKAGES) $(SYNC_PACKAGES)
lint-packages:
	@tests/tools/install_packages.sh $(BUILD_PACKAGES) $(TEST_PACKAGES) $(LINT_PACKAGES)
analyze-packages:
	@tests/tools/install_packages.sh $(BUILD_PACKAGES) $(TEST_PACKAGES) $(ANALYZE_PACKAGES)
coverage-packages:
	@tests/tools/install_packages.sh $(BUILD_PACKAGES) $(TEST_PACKAGES) $(COVERAGE_PACKAGES)
fuzz-packages:
	@tests/tools/install_packages.sh $(BUILD_PACKAGES) $(FUZZ_PACKAGES)
fidelity-packages:
	@tests/tools/install_packages.sh $(BUILD_PACKAGES) $(FIDELITY_PACKAGES)
deb-packages:
	@tests/tools/install_packages.sh $(BUILD_PACKAGES) $(DEB_PACKAGES)
farm-packages: test-packages
	@tests/tools/install_packages.sh $(FARM_PACKAGES)
web-packages: test-packages
	@tests/tools/install_packages.sh $(WEB_PACKAGES)
blender-packages: build-packages
	@tests/tools/install_packages.sh $(BLENDER_PACKAGES)
equal-time-packages:
	@tests/tools/install_packages.sh $(BUILD_PACKAGES) $(EQUAL_TIME_PACKAGES)

JOBS ?= $(shell nproc)
# A second make, because packages that were just installed change what pkg-config says.
test: test-packages
	$(MAKE) -j$(JOBS) all tests
	python3 tests/tools/run_tests.py $(B) $(TESTS)
# What `make test` leaves out, in seven parts (tests/tools/suite.py): one of them, or all.
PART ?= $(shell date -u +%u)
test-part: test-packages stack-packages
	$(MAKE) -j$(JOBS) all tests-all
	python3 tests/tools/rest.py $(B) $(PART)
test-all:
	$(MAKE) test-part PART=all
# What depends on the driver, on Mesa's zink over lavapipe.
test-zink: stack-packages
	$(MAKE) -j$(JOBS) all tests
	python3 tests/tools/run_tests.py $(B) $(or $(TESTS:%=zink/%),zink/)
# Frames under Vulkan's synchronisation validation: where a glMemoryBarrier() is missing.
check-sync: sync-packages
	$(MAKE) -j$(JOBS) $(B)/tests/unit/unit_tests $(B)/tests/tools/sync_layer.so
	python3 tests/tools/check_sync.py $(B)
$(B)/tests/tools/sync_layer.so: tests/tools/sync_layer.c
	@mkdir -p $(@D)
	$(call say,LINK)$(CC) -shared -fPIC $(CPPFLAGS_ALL) $(OPT) $(CFLAGS_ALL) $(WARN_C) $(LDFLAGS_ALL) $< -o $@
demo: build-packages
	$(MAKE) -j$(JOBS) all $(B)/tests/tools/make_scenes
	tests/tools/demo.sh $(B) out $(FAST)
# The programs that are measured, and those that measure.
BENCHED = all $(BENCH_PROGRAM) $(SHAPED_LINK) $(B)/tests/tools/make_scenes
bench: test-packages
	$(MAKE) -j$(JOBS) $(BENCHED)
	python3 tests/bench/bench.py $(B) $(BENCH)
# Pictures beside those of known renderers, and noise over time beside Cycles, of models below FARLIGHT_SCENES.
SAMPLES ?= 256
fidelity: fidelity-packages
	$(MAKE) -j$(JOBS) all
	/usr/bin/python3 tests/fidelity/fidelity.py $(B) --samples $(SAMPLES) $(if $(SMALL),--small) --only "$(ONLY)"
equal-time: equal-time-packages
	$(MAKE) -j$(JOBS) all $(B)/tests/tools/make_scenes
	/usr/bin/python3 tests/fidelity/equal_time.py $(B) --only "$(ONLY)" $(OPTIONS)
# Rounds of 10 connects, one upload and 100 frames; after them a daemon must have what it had.
ROUNDS ?= 1000
soak: test-packages
	$(MAKE) -j$(JOBS) all
	python3 tests/soak/soak.py $(B) $(ROUNDS)
# Rounds of an animation whose daemon or client is killed at a random moment; SEED= repeats a run.
farm-drill: test-packages
	$(MAKE) -j$(JOBS) all
	python3 tests/soak/drill.py $(B) $(ROUNDS) $(if $(SEED),--seed $(SEED))
# The templates of conf/farm: Slurm with killed workers, and what stands in for other managers. Debian's own Python has yaml.
farm-test: farm-packages
	$(MAKE) -j$(JOBS) all tests
	/usr/bin/python3 tests/farm/farm.py $(B)
# The page of farlight-web in headless Chromium. Debian's own Python has websocket.
web-test: web-packages
	$(MAKE) -j$(JOBS) all tests
	FARLIGHT_BIN=$(CURDIR)/$(B) /usr/bin/python3 tests/web/test_browser.py

# The add-on in Blender, without a window; pictures beside Cycles'. Then its viewport, on a virtual screen.
blender-test: blender-packages
	$(MAKE) -j$(JOBS) all
	blender --background --factory-startup --python-exit-code 1 --python tests/blender/test_addon.py -- $(B) $(TESTS)
	xvfb-run -a -s "-screen 0 640x480x24" blender --factory-startup --window-geometry 0 0 640 480 --python tests/blender/viewport.py -- $(B)
# One file for Blender's preferences, with the Python package in it.
blender-addon: $(PYTHON_PACKAGE)
	rm -rf build/blender && mkdir -p build/blender/farlight_blender/bundled out
	cp client/blender/farlight_blender/*.py build/blender/farlight_blender
	mkdir build/blender/farlight_blender/bundled/farlight
	cp $(B)/python/farlight/*.py build/blender/farlight_blender/bundled/farlight
	cd build/blender && python3 -m zipfile -c $(CURDIR)/out/farlight_blender.zip farlight_blender

# One user attacks a daemon in every way that tests/siege knows, another one looks at a triangle beside it.
siege: test-packages
	$(MAKE) -j$(JOBS) all
	FARLIGHT_BIN=$(CURDIR)/$(B) python3 tests/siege/siege.py $(ATTACKS)
# Measures what the curves need where out/bench.json does not have it yet.
bench-plot: test-packages
	$(MAKE) -j$(JOBS) $(BENCHED)
	python3 tests/bench/bench_plot.py $(B)

# ---- what is checked without running it
# Once for all configurations, until a header changes.
HEADERS_STAMP := build/headers-alone
check-headers: $(HEADERS_STAMP)
$(HEADERS_STAMP): tests/tools/check_headers.sh Makefile $(call sources,protocol server shaders client,h)
	@tests/tools/check_headers.sh $(CC) -I. -Iserver -Ishaders -Iclient $(SERVER_CFLAGS) $(CLIENT_CFLAGS)
	@mkdir -p $(@D) && touch $@
FORMATTED = $(call sources,server protocol client tests shaders,c h hpp cpp)
format:
	clang-format -i $(FORMATTED)
# Include rules, headers alone, layout: without installing, and without clang's compiler.
check-rules: check-headers
	@python3 tests/tools/check_includes.py
	@python3 tests/tools/check_comments.py
	@printf '%s\n' $(FORMATTED) | xargs -P $(JOBS) -n 40 clang-format --dry-run -Werror
lint: lint-packages $(PYTHON_PACKAGE)
	@$(MAKE) -s check-rules compile_commands.json
	python3 tests/tools/check_shaders.py
	cd $(B)/python && mypy --strict --cache-dir $(CURDIR)/build/mypy -p farlight
	cd client/blender && MYPYPATH=$(CURDIR)/$(B)/python mypy --strict --ignore-missing-imports --cache-dir $(CURDIR)/build/mypy farlight_blender
	python3 tests/tools/compile_commands.py --syntax
# About a minute after a build; installs nothing, and names what is missing.
check:
	@tests/tools/install_packages.sh --check $(BUILD_PACKAGES) libcmocka-dev python3 clang-format
	@$(MAKE) -s check-rules
	@$(MAKE) -j$(JOBS) $(B)/tests/unit/unit_tests
	@python3 tests/tools/run_tests.py $(B) $(PURE_TESTS)
# Tests that need no GPU, no daemon and no file outside the checkout.
PURE_TESTS := /base/ /net/ /protocol/ /scene/ /client/catalogue /client/frames /client/json /client/keys /client/text /client/y4m /edit/assignment /edit/field /warp/ \
    /engine/camera_path /engine/scheduler /render/sequence /session/config /session/edits /session/limits /session/pacing
# How each source is compiled, for editors and clang's tools; from our own rules.
.PHONY: compile_commands.json
compile_commands.json:
	@$(MAKE) -nB V=1 --no-print-directory all tests-all | python3 tests/tools/compile_commands.py >$@.new && mv $@.new $@
# gcc's analyzer knows C only. What it finds is an error of the build, whose objects stay: a second run costs what changed.
analyze: analyze-packages
	@$(MAKE) -s compile_commands.json
	python3 tests/tools/compile_commands.py --tidy server/ protocol/ client/
	$(MAKE) -j$(JOBS) CC=gcc CXX=g++ B=build/analyze CFLAGS='$(ANALYZE_FLAGS)' $(patsubst $(B)/%,build/analyze/%,$(ANALYZED))
ANALYZE_FLAGS := -fanalyzer
ANALYZED = $(filter-out $(B)/shader_sources.o %.opp %.a,$(sort $(SERVER_OBJ) $(PROTOCOL_OBJ) $(LIB_OBJ) $(CLI_OBJ) $(VIEWER_OBJ) \
    $(WEB_OBJ) $(HELPER_OBJ) $(OPTIONS_OBJ) $(IMPORT_OBJ) $(EXPORT_OBJ) $(VIDEO_OBJ)))
# Lines that tests reach, as HTML; TESTS chooses among them. A program that may not write its counts, in a sandbox or beyond a limit,
# fails its test; what the others have reached is shown all the same.
# Figures are written when a process ends, which the daemon's sandbox would refuse.
coverage: coverage-packages
	$(MAKE) -j$(JOBS) config=coverage all tests
	find build/coverage -name '*.gcda' -delete
	-FARLIGHT_SERVER_SANDBOX=no python3 tests/tools/run_tests.py build/coverage $(TESTS)
	@mkdir -p out/coverage
	gcovr -j $(JOBS) --root . --filter 'server/' --filter 'client/' --filter 'protocol/' --gcov-ignore-parse-errors \
	    --html-details out/coverage/index.html --print-summary build/coverage

# Where Debian's python3 looks: it has one folder for all versions below /usr, and one for each below /usr/local.
PYTHON_VERSION := $(if $(filter-out /usr,$(PREFIX)),$(shell /usr/bin/python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null),3)
PYTHON_FOLDER ?= $(PREFIX)/lib/python$(PYTHON_VERSION)/dist-packages
install: all
	install -d $(DESTDIR)$(PYTHON_FOLDER)/farlight $(DESTDIR)$(PREFIX)/share/doc/farlight/examples/python
	install -m 644 $(B)/python/farlight/*.py $(B)/python/farlight/py.typed $(DESTDIR)$(PYTHON_FOLDER)/farlight
	install -m 755 client/python/examples/*.py $(DESTDIR)$(PREFIX)/share/doc/farlight/examples/python
	install -m 644 client/python/README.md $(DESTDIR)$(PREFIX)/share/doc/farlight/python.md
	install -d $(DESTDIR)$(PREFIX)/share/farlight/blender/farlight_blender
	install -m 644 client/blender/farlight_blender/*.py $(DESTDIR)$(PREFIX)/share/farlight/blender/farlight_blender
	install -m 644 client/blender/README.md $(DESTDIR)$(PREFIX)/share/doc/farlight/blender.md
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/share/farlight \
	    $(addprefix $(DESTDIR)$(PREFIX)/share/man/man,1 3 5 7 8) \
	    $(DESTDIR)$(PREFIX)/share/doc/farlight/examples $(DESTDIR)/etc/farlight \
	    $(DESTDIR)$(UNITDIR) $(DESTDIR)$(PREFIX)/lib/sysusers.d
	install -d $(DESTDIR)$(LIBDIR)/pkgconfig $(DESTDIR)$(PREFIX)/include/farlight \
	    $(DESTDIR)$(PREFIX)/include/farlight/protocol $(DESTDIR)$(PREFIX)/include/farlight/warp \
	    $(DESTDIR)$(PREFIX)/share/bash-completion/completions
	install -m 755 $(PROGRAMS) $(DESTDIR)$(PREFIX)/bin
	install -d $(DESTDIR)$(PREFIX)/lib/farlight
	install -m 644 $(MODULES) $(DESTDIR)$(PREFIX)/lib/farlight
	install -m 755 $(B)/$(SONAME) $(DESTDIR)$(LIBDIR)
	ln -sf $(SONAME) $(DESTDIR)$(LIBDIR)/libfarlight.so
	install -m 644 $(B)/libfarlight.a $(DESTDIR)$(LIBDIR)
	for header in $(PUBLIC_HEADERS); do case $$header in client/lib/*) name=client.h ;; *) name=$${header#client/} ;; esac; \
	    sed 's,^#include "\(protocol\|warp\)/,#include "farlight/\1/,' $$header >$(DESTDIR)$(PREFIX)/include/farlight/$$name; done
	sed 's#@PREFIX@#$(PREFIX)#; s#@LIBDIR@#$(patsubst $(PREFIX)/%,$${prefix}/%,$(LIBDIR))#; s#@VERSION@#$(VERSION)#' conf/farlight.pc.in \
	    >$(DESTDIR)$(LIBDIR)/pkgconfig/farlight.pc
	install -m 644 client/cli/completion.bash $(DESTDIR)$(PREFIX)/share/bash-completion/completions/farlight
	for name in $(filter-out farlight,$(notdir $(PROGRAMS))); do \
	    ln -sf farlight $(DESTDIR)$(PREFIX)/share/bash-completion/completions/$$name; done
	for page in $(filter-out conf/man/farlight.1,$(wildcard conf/man/*)) $(B)/man/farlight.1; do sed 's#@VERSION@#$(VERSION)#' $$page \
	    >$(DESTDIR)$(PREFIX)/share/man/man$${page##*.}/$${page##*/}; done
	install -m 644 $(B)/shot.schema.json $(DESTDIR)$(PREFIX)/share/farlight
	install -m 644 README.md CHANGELOG.md SECURITY.md LICENSE $(B)/protocol.md $(DESTDIR)$(PREFIX)/share/doc/farlight
	install -m 644 conf/examples/* $(DESTDIR)$(PREFIX)/share/doc/farlight/examples
	install -d $(DESTDIR)$(PREFIX)/share/farlight/farm
	install -m 644 $(addprefix conf/farm/,README.md openjd.yaml openjd-still.yaml flamenco.js flamenco-still.js) $(DESTDIR)$(PREFIX)/share/farlight/farm
	install -m 755 conf/farm/xargs.sh conf/farm/slurm.sbatch $(DESTDIR)$(PREFIX)/share/farlight/farm
	install -m 755 conf/farm/farlight-node $(DESTDIR)$(PREFIX)/bin
	install -m 644 conf/farlightd.conf $(DESTDIR)/etc/farlight
	sed 's#/usr/local/bin#$(PREFIX)/bin#' conf/farlightd.service >$(DESTDIR)$(UNITDIR)/farlightd.service
	install -m 644 conf/farlightd.socket $(DESTDIR)$(UNITDIR)
	install -m 644 conf/sysusers.conf $(DESTDIR)$(PREFIX)/lib/sysusers.d/farlight.conf

uninstall:
	rm -f $(addprefix $(DESTDIR)$(PREFIX)/bin/,$(notdir $(PROGRAMS)) farlight-node)
	rm -f $(addprefix $(DESTDIR)$(PREFIX)/share/man/man1/,$(notdir $(wildcard conf/man/*.1)))
	rm -f $(addprefix $(DESTDIR)$(PREFIX)/share/man/man3/,$(notdir $(wildcard conf/man/*.3)))
	rm -f $(addprefix $(DESTDIR)$(PREFIX)/share/man/man5/,$(notdir $(wildcard conf/man/*.5)))
	rm -f $(addprefix $(DESTDIR)$(PREFIX)/share/man/man7/,$(notdir $(wildcard conf/man/*.7)))
	rm -f $(addprefix $(DESTDIR)$(PREFIX)/share/man/man8/,$(notdir $(wildcard conf/man/*.8)))
	rm -f $(DESTDIR)$(LIBDIR)/$(SONAME) $(addprefix $(DESTDIR)$(LIBDIR)/libfarlight.,so a) \
	    $(DESTDIR)$(LIBDIR)/pkgconfig/farlight.pc \
	    $(addprefix $(DESTDIR)$(PREFIX)/share/bash-completion/completions/,$(notdir $(PROGRAMS)))
	rm -f $(addprefix $(DESTDIR)$(UNITDIR)/farlightd.,service socket) \
	    $(DESTDIR)$(PREFIX)/lib/sysusers.d/farlight.conf
	rm -rf $(DESTDIR)$(PYTHON_FOLDER)/farlight
	rm -rf $(DESTDIR)$(PREFIX)/lib/farlight $(DESTDIR)$(PREFIX)/share/doc/farlight $(DESTDIR)$(PREFIX)/share/farlight $(DESTDIR)$(PREFIX)/include/farlight

# ---- packages ----
# From what is committed; the same commit gives the same bytes.
SOURCE_DATE_EPOCH = $(shell git log -1 --format=%ct)
DIST := out/farlight-$(VERSION).tar.xz
dist:
	@mkdir -p out
	git archive --prefix=farlight-$(VERSION)/ HEAD | xz -T1 >$(DIST)
	@echo '$(DIST)'
# Debian packages into out/deb, checked by lintian.
build_deb = conf/debian/build.sh $(1) $(VERSION) $(SOURCE_DATE_EPOCH) $(filter-out gcc g++ make fonts-% libegl1 libgl1-mesa-dri,$(BUILD_PACKAGES))
deb: deb-packages
	$(call build_deb,build/deb)
	rm -rf out/deb && mkdir -p out/deb
	mv build/deb/*.deb build/deb/*.buildinfo build/deb/*.changes out/deb
	lintian --fail-on error,warning out/deb/*.changes
# Once more, in another folder, time zone, language and mask of files: the same bytes.
deb-same: deb
	umask 077 && TZ=Pacific/Auckland LC_ALL=C.UTF-8 $(call build_deb,build/deb-same/in/a/longer/path)
	for package in out/deb/*.deb; do cmp $$package build/deb-same/in/a/longer/path/$${package##*/} || exit 1; done
	rm -rf build/deb-same
	@echo "built twice, the same bytes: $$(ls out/deb/*.deb | wc -l) packages"
# On a clean Debian 12: install, render as the service does, remove without a trace. Needs root and Debian's archive.
deb-test: deb
	@tests/tools/install_packages.sh debootstrap
	$(MAKE) $(DEB_SCENES)
	tests/packages/clean_install.sh $(DEB_SCENES)
# The image of conf/Containerfile: build it of the packages, render with its daemon. Needs root and Debian's archive.
container-test: deb
	@tests/tools/install_packages.sh debootstrap buildah iproute2
	$(MAKE) $(DEB_SCENES) $(B)/farlight
	tests/packages/container.sh $(B) $(DEB_SCENES)
DEB_SCENES := build/deb-scenes
$(DEB_SCENES): $(B)/tests/tools/make_scenes
	mkdir -p $@ && $< $@
# What was rendered and measured stays.
clean:
	rm -rf build compile_commands.json
distclean: clean
	rm -rf out

help:
	@echo 'make demo       install what is missing, build, render the bundled scenes into out/   [FAST=1: one picture]'
	@echo 'make test       install what tests need, build, run what a commit has to pass   [TESTS=part-of-a-name]'
	@echo 'make test-all   the rest of the tests and checks, which takes hours; make test-part: one part in seven   [PART=3]'
	@echo 'make test-zink  what depends on the driver, on another OpenGL stack   [TESTS=part-of-a-name]'
	@echo 'make check-sync frames under Vulkan synchronisation validation, to find missing memory barriers'
	@echo 'make bench      measure, into out/bench.txt and out/bench.json   [BENCH="family reach"; see tests/bench/bench.py]'
	@echo 'make fidelity   compare pictures with those of known renderers, into out/fidelity   [SAMPLES=256 SMALL=1 ONLY=scene,scene]'
	@echo 'make equal-time measure noise over time beside Cycles, into out/equal-time   [ONLY=scene,scene OPTIONS="--denoise"]'
	@echo 'make soak       use one daemon for some minutes, and see that its memory stays flat   [ROUNDS=1000]'
	@echo 'make farm-drill kill the daemon or the client of animations at random, and see that no frame is lost   [ROUNDS=1000 SEED=]'
	@echo 'make deb        build Debian packages into out/deb; make dist: an archive of the sources'
	@echo 'make deb-same   build them once more in another folder, and see that they have the same bytes'
	@echo 'make deb-test   build them, install them on a clean Debian, render there, and remove them'
	@echo 'make container-test   build the image of conf/Containerfile of them, and render with its daemon'
	@echo 'make farm-test  try the templates of conf/farm on Slurm and what stands in for other queues'
	@echo 'make web-test   the page of farlight-web in headless Chromium'
	@echo 'make blender-test   try the add-on in Blender, and compare its pictures with those of Cycles   [TESTS="words"]'
	@echo 'make blender-addon  the add-on as one file for Blender, out/farlight_blender.zip'
	@echo 'make siege      attack a daemon as one user, and see that another one does not notice   [ATTACKS="stats pings"]'
	@echo 'make bench-plot draw the scaling curves into out/, as SVG and PNG'
	@echo 'make all        build the programs into build/$$config/   [config=debug|release|sanitize|fuzz EMBREE=0]'
	@echo 'make fuzz       run every fuzzer for a while   [SECONDS=20]'
	@echo 'make check      the rules of the sources and the unit tests that need no GPU and no daemon; installs nothing'
	@echo 'make lint       include rules, headers alone, openings of comments, format, shaders, clang with warnings as errors'
	@echo 'make analyze    clang-tidy and gcc -fanalyzer'
	@echo 'make coverage   which lines tests reach, into out/coverage   [TESTS=part-of-a-name]'
	@echo 'make compile_commands.json   how each source is compiled, for editors'
	@echo 'make format     clang-format over our sources'
	@echo 'make install    [PREFIX=/usr/local DESTDIR=]'
	@echo 'make clean      remove build/; distclean removes out/ as well'

-include $(shell find $(B) -name '*.d' 2>/dev/null)
.SECONDARY:

# ---- fuzz ----
# make fuzz SECONDS=20: every fuzzer for so long, $(JOBS) at once, from valid inputs made of the table and from those that
# are kept. What they find stays in build/fuzz/found; their corpus lives in build/fuzz/corpus and grows from run to run.
# make fuzz-keep takes what of it reaches more than others into tests/fuzz/corpus, which the unit tests run.
FUZZ_SECONDS ?= 20
ifeq ($(origin SECONDS),command line)
FUZZ_SECONDS := $(SECONDS)
endif
FUZZERS := $(patsubst tests/fuzz/fuzz_%.c,%,$(wildcard tests/fuzz/fuzz_*.c))
FUZZ_SEED := $(B)/tests/fuzz/seed
FUZZ_DICTIONARY := $(B)/seed/protocol.dict
KEPT_BYTES := 1600
KEPT_BYTES_OF_ALL := 65536
$(FUZZ_SEED): %: %.o $(B)/tests/fuzz/seed_frames.o $(B)/tests/fuzz/recorded_session.o $(COMMON_OBJ) $(PROTOCOL_OBJ) $(PIXELS_OBJ) $(SEALED_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $^ $(call pkg_libs,libsodium libzstd libxxhash libturbojpeg) -lm -o $@
$(addprefix $(B)/tests/fuzz/fuzz_,$(FUZZERS)): %: %.o $(PROTOCOL_OBJ)
	$(call say,LINK)$(CXX) $(OPT) -fsanitize=fuzzer $(LDFLAGS_ALL) $^ $(FUZZ_LIBS) -o $@
$(B)/tests/fuzz/fuzz_scene $(B)/tests/fuzz/fuzz_transaction: $(filter $(B)/server/scene/% $(B)/server/base/%,$(SERVER_OBJ)) $(COMMON_OBJ)
$(B)/tests/fuzz/fuzz_sealed: $(SEALED_OBJ)
$(addprefix $(B)/tests/fuzz/fuzz_,scene sealed transaction): FUZZ_LIBS = $(call pkg_libs,libsodium libxxhash) -lm
$(B)/tests/fuzz/fuzz_session: $(SERVING_OBJ) $(SERVER_OBJ)
$(B)/tests/fuzz/fuzz_session: FUZZ_LIBS = $(SERVER_LIBS) $(SERVING_WRAP)
$(B)/tests/fuzz/fuzz_coarse_depth: $(PIXELS_OBJ)
$(B)/tests/fuzz/fuzz_coarse_depth: FUZZ_LIBS = $(call pkg_libs,libzstd) -lm
$(B)/tests/fuzz/fuzz_frame: $(LIB_OBJ)
$(B)/tests/fuzz/fuzz_frame: FUZZ_LIBS = $(call pkg_libs,$(CLIENT_PKGS)) -lm
$(B)/tests/fuzz/fuzz_request: $(B)/web.a $(LIB_OBJ)
$(B)/tests/fuzz/fuzz_request: FUZZ_LIBS = $(call pkg_libs,$(CLIENT_PKGS)) -lm
$(B)/tests/fuzz/fuzz_warp: $(WARP_OBJ)
$(B)/tests/fuzz/fuzz_warp: FUZZ_LIBS = -lm
$(addprefix $(B)/tests/fuzz/fuzz_,assimp environment gltf nff obj threemf): $(READERS_OBJ)
$(addprefix $(B)/tests/fuzz/fuzz_,assimp environment gltf nff obj threemf): FUZZ_LIBS = $(READERS_LIBS)
# OpenImageIO loses memory with broken images; the importer lives for one model only.
run-fuzz-gltf run-fuzz-obj: FUZZ_FLAGS = -detect_leaks=0
.PHONY: fuzz fuzz-keep $(addprefix run-fuzz-,$(FUZZERS)) $(addprefix keep-fuzz-,$(FUZZERS))
ifeq ($(config),fuzz)
# Readers of Assimp have crashes of their own, which the importer's sandbox contains; so run-fuzz-assimp is called by name.
fuzz: $(addprefix run-fuzz-,$(filter-out assimp,$(FUZZERS)))
fuzz-keep: $(addprefix keep-fuzz-,$(FUZZERS))
else
fuzz fuzz-keep: fuzz-packages
	$(MAKE) -j$(JOBS) config=fuzz $@
endif
# The dictionary, and with it the valid inputs.
$(FUZZ_DICTIONARY): $(FUZZ_SEED)
	$< $(@D)
# The limit of an input's time is wall time: most take a millisecond, and other work must not look like a hang.
$(addprefix run-fuzz-,$(FUZZERS)): run-fuzz-%: $(B)/tests/fuzz/fuzz_% $(FUZZ_DICTIONARY)
	@mkdir -p $(B)/corpus/$* $(B)/seed/$* $(B)/found
	@$< -max_total_time=$(FUZZ_SECONDS) -max_len=8192 -timeout=20 -rss_limit_mb=1024 -use_value_profile=1 \
		-print_final_stats=1 -dict=$(FUZZ_DICTIONARY) -artifact_prefix=$(B)/found/$*- $(B)/corpus/$* $(B)/seed/$* \
		$(wildcard tests/fuzz/corpus/$*) $(FUZZ_FLAGS) \
		>$(B)/found/$*.log 2>&1 || { tail -n 60 $(B)/found/$*.log; exit 1; }
	@sed -n 's/.*DONE/$*: &/p' $(B)/found/$*.log
# Small ones, and of each fuzzer no more than so much, as they come (their names are hashes), so that it stays small.
$(addprefix keep-fuzz-,$(FUZZERS)): keep-fuzz-%: $(B)/tests/fuzz/fuzz_% $(FUZZ_DICTIONARY)
	@mkdir -p $(B)/corpus/$* $(B)/kept/$* tests/fuzz/corpus/$*
	@rm -f $(B)/kept/$*/*
	$< -merge=1 -use_counters=0 -max_len=$(KEPT_BYTES) $(B)/kept/$* tests/fuzz/corpus/$* $(B)/seed/$* $(B)/corpus/$* >$(B)/found/$*-keep.log 2>&1
	@rm -f tests/fuzz/corpus/$*/*
	@bytes=0; for file in $(B)/kept/$*/*; do bytes=$$((bytes + $$(stat -c %s $$file))); \
		if [ $$bytes -gt $(KEPT_BYTES_OF_ALL) ]; then break; fi; cp $$file tests/fuzz/corpus/$*; done
# ---- fuzz ----
