# Installation and packages. A part of the Makefile, which includes it.

.PHONY: install uninstall dist deb deb-same deb-test container-test blender-addon

# Where Debian's python3 looks: it has one folder for all versions below /usr, and one for each below /usr/local.
PYTHON_NUMBERS = $(shell /usr/bin/python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null)
PYTHON_VERSION := $(if $(filter-out /usr,$(PREFIX)),$(PYTHON_NUMBERS),3)
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
	install -m 644 $(addprefix conf/farm/,README.md openjd.yaml openjd-still.yaml flamenco.js flamenco-still.js) \
	    $(DESTDIR)$(PREFIX)/share/farlight/farm
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
	rm -rf $(addprefix $(DESTDIR)$(PREFIX)/,lib/farlight share/doc/farlight share/farlight include/farlight)

# ---- packages ----
# From what is committed; the same commit gives the same bytes.
SOURCE_DATE_EPOCH = $(shell git log -1 --format=%ct)
DIST := out/farlight-$(VERSION).tar.xz
dist:
	@mkdir -p out
	git archive --prefix=farlight-$(VERSION)/ HEAD | xz -T1 >$(DIST)
	@echo '$(DIST)'
# Debian packages into out/deb, checked by lintian.
build_deb = conf/debian/build.sh $(1) $(VERSION) $(SOURCE_DATE_EPOCH) \
    $(filter-out gcc g++ make fonts-% libegl1 libgl1-mesa-dri,$(BUILD_PACKAGES))
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
# One file for Blender's preferences, with the Python package in it.
blender-addon: $(PYTHON_PACKAGE)
	rm -rf build/blender && mkdir -p build/blender/farlight_blender/bundled out
	cp client/blender/farlight_blender/*.py build/blender/farlight_blender
	mkdir build/blender/farlight_blender/bundled/farlight
	cp $(B)/python/farlight/*.py build/blender/farlight_blender/bundled/farlight
	cd build/blender && python3 -m zipfile -c $(CURDIR)/out/farlight_blender.zip farlight_blender
