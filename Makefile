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
HELPER_OBJ := $(call obj,$(call sources,client/helper,c) protocol/common/landlock.c)
OPTIONS_OBJ := $(call obj,$(call sources,client/options,c))
VIEWER_OBJ := $(call obj,$(VIEWER_C))
WEB_OBJ := $(call obj,$(WEB_C))
IMPORT_OBJ := $(call obj,$(IMPORT_C) $(IMPORT_CXX)) $(COMMON_OBJ) $(B)/helper.a
EXPORT_OBJ := $(call obj,$(EXPORT_C) $(EXPORT_CXX)) $(B)/helper.a
VIDEO_OBJ := $(call obj,$(VIDEO_C) client/lib/rate.c protocol/pixels/ycbcr.c) $(B)/helper.a

# The library for others' programs: only what farlight.h declares is visible.
SONAME := libfarlight.so.$(firstword $(subst ., ,$(VERSION)))
# farlight.h is installed as <farlight/client.h>, the others below farlight/.
PUBLIC_HEADERS := client/lib/farlight.h client/warp/warp.h \
    $(addprefix protocol/,messages.h messages.def values.h values.def tracers.h tracers.def words.h words.def)
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
IMPORT_ALL_PKGS := $(IMPORT_PKGS) $(TEXTURE_PKGS) $(ASSIMP_PKGS)
IMPORT_CFLAGS = $(eval IMPORT_CFLAGS := $(patsubst -I%,-isystem %,$(call pkg_cflags,$(IMPORT_ALL_PKGS))))$(IMPORT_CFLAGS)
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

# ---- what people call ------------------------------------------------------------------------------
BUILD_PACKAGES := gcc g++ make pkg-config libepoxy-dev libegl-dev libgl-dev libcglm-dev libturbojpeg0-dev libzstd-dev \
    libsodium-dev libxxhash-dev libinih-dev libjansson-dev libjemalloc-dev libseccomp-dev libopenimageio-dev \
    libpng-dev libtiff-dev libexif-dev libopenexr-dev libjxl-dev libtinygltf-dev \
    libtinyobjloader-dev libdraco-dev libmeshoptimizer-dev libstb-dev libassimp-dev libexpat1-dev libminizip-dev \
    libembree-dev libavcodec-dev libavformat-dev libavfilter-dev libavutil-dev libswscale-dev libsdl2-dev libsdl2-ttf-dev \
    libwebsockets-dev fonts-dejavu-core libegl1 libgl1-mesa-dri python3
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

.PHONY: build-packages test-packages stack-packages sync-packages lint-packages analyze-packages coverage-packages fuzz-packages
.PHONY: fidelity-packages equal-time-packages farm-packages web-packages deb-packages blender-packages demo clean distclean help
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
demo: build-packages
	$(MAKE) -j$(JOBS) all $(B)/tests/tools/make_scenes
	tests/tools/demo.sh $(B) out $(FAST)
# What was rendered and measured stays.
clean:
	rm -rf build compile_commands.json
distclean: clean
	rm -rf out

include tests/tests.mk
include conf/install.mk

help:
	@echo 'make demo       install what is missing, build, render the bundled scenes into out/   [FAST=1: one picture]'
	@echo 'make test       install what tests need, build, run what a commit has to pass   [TESTS=part-of-a-name]'
	@echo 'make test-all   the rest of the tests and checks, which takes hours; make test-part: one part in seven   [PART=3]'
	@echo 'make test-zink  what depends on the driver, on another OpenGL stack   [TESTS=part-of-a-name]'
	@echo 'make check-sync frames under Vulkan synchronisation validation, to find missing memory barriers'
	@echo 'make bench      measure, into out/bench.txt and out/bench.json   [BENCH="family reach"; see tests/bench/bench.py]'
	@echo 'make bench-gpu  measure a GPU in one run; without one, rehearse it   [out/bench-gpu runs on another machine, too]'
	@echo 'make fidelity   compare pictures with those of known renderers, into out/fidelity   [SAMPLES=256 SMALL=1 ONLY=scene,scene]'
	@echo 'make equal-time measure noise over time beside Cycles, into out/equal-time   [ONLY=scene,scene OPTIONS="--denoise"]'
	@echo 'make soak       use one daemon for some minutes, and see that its memory stays flat   [ROUNDS=1000]'
	@echo 'make farm-drill kill the daemon or the client of animations at random, and see that no frame is lost   [ROUNDS=1000 SEED=]'
	@echo 'make breaks     kill the worker of an animation, or take its GPU, again and again   [ROUNDS=1000]'
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
