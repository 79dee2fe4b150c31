# The tests, benchmarks and checks. A part of the Makefile, which includes it.

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
$(B)/tests/unit/unit_tests: $(B)/client/helper/sandbox.o $(B)/client/import/model/closed.o $(B)/web.a $(B)/options.a \
    $(MODEL_OBJ) $(B)/tests/fixtures/frame_hooks.o
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
.PHONY: tests tests-all test test-part test-all test-zink check-sync bench bench-gpu fidelity equal-time soak farm-drill breaks farm-test web-test
.PHONY: blender-test siege bench-plot check-headers check-rules lint check analyze coverage format
tests: $(TEST_PROGRAMS) $(CONTRACT) $(B)/tests/tools/make_scenes $(B)/tests/tools/pose_dump $(LOSING_DAEMON)
# With the benchmark, whose own tests need it.
tests-all: tests $(BENCH_PROGRAM) $(SHAPED_LINK)

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
# The programs that are measured, and those that measure.
BENCHED = all $(BENCH_PROGRAM) $(SHAPED_LINK) $(B)/tests/tools/make_scenes
bench: test-packages
	$(MAKE) -j$(JOBS) $(BENCHED)
	python3 tests/bench/bench.py $(B) $(BENCH)
# What a GPU does, in a run of ten minutes; out/bench-gpu can be copied to a machine that has one (tests/bench/bench_gpu.py).
bench-gpu: test-packages
	$(MAKE) -j$(JOBS) $(BENCHED)
	python3 tests/bench/bench_gpu.py pack $(B) out/bench-gpu
	python3 out/bench-gpu/bench_gpu.py run --out out/bench-gpu
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
# An animation whose worker is killed, or loses its GPU, so many times.
breaks: test-packages
	$(MAKE) -j$(JOBS) all tests
	python3 tests/soak/breaks.py $(B) killed $(ROUNDS)
	python3 tests/soak/breaks.py $(B) lost $(ROUNDS)
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
	cd client/blender && MYPYPATH=$(CURDIR)/$(B)/python mypy --strict --ignore-missing-imports \
	    --cache-dir $(CURDIR)/build/mypy farlight_blender
	python3 tests/tools/compile_commands.py --syntax
# About a minute after a build; installs nothing, and names what is missing.
check:
	@tests/tools/install_packages.sh --check $(BUILD_PACKAGES) libcmocka-dev python3 clang-format
	@$(MAKE) -s check-rules
	@$(MAKE) -j$(JOBS) $(B)/tests/unit/unit_tests
	@python3 tests/tools/run_tests.py $(B) $(PURE_TESTS)
# Tests that need no GPU, no daemon and no file outside the checkout.
PURE_TESTS := /base/ /net/ /protocol/ /scene/ /client/catalogue /client/frames /client/json /client/keys /client/text /client/y4m \
    /edit/assignment /edit/field /warp/ \
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
$(FUZZ_SEED): %: %.o $(B)/tests/fuzz/seed_frames.o $(B)/tests/fuzz/recorded_session.o \
    $(COMMON_OBJ) $(PROTOCOL_OBJ) $(PIXELS_OBJ) $(SEALED_OBJ)
	$(call say,LINK)$(CC) $(OPT) $(LDFLAGS_ALL) $^ $(call pkg_libs,libsodium libzstd libxxhash libturbojpeg) -lm -o $@
$(addprefix $(B)/tests/fuzz/fuzz_,$(FUZZERS)): %: %.o $(PROTOCOL_OBJ)
	$(call say,LINK)$(CXX) $(OPT) -fsanitize=fuzzer $(LDFLAGS_ALL) $^ $(FUZZ_LIBS) -o $@
$(B)/tests/fuzz/fuzz_scene $(B)/tests/fuzz/fuzz_transaction: $(COMMON_OBJ) \
    $(filter-out %/confinement.o,$(filter $(B)/server/scene/% $(B)/server/base/%,$(SERVER_OBJ)))
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
	$< -merge=1 -use_counters=0 -max_len=$(KEPT_BYTES) $(B)/kept/$* tests/fuzz/corpus/$* \
	    $(B)/seed/$* $(B)/corpus/$* >$(B)/found/$*-keep.log 2>&1
	@rm -f tests/fuzz/corpus/$*/*
	@bytes=0; for file in $(B)/kept/$*/*; do bytes=$$((bytes + $$(stat -c %s $$file))); \
		if [ $$bytes -gt $(KEPT_BYTES_OF_ALL) ]; then break; fi; cp $$file tests/fuzz/corpus/$*; done
