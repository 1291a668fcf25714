# boresight: `make run` starts a guided session, `make test` runs all tests.
# Both set up what they need on Debian 12 or newer with a Rust toolchain.

ARGS ?=
# What the build needs from Debian besides the Rust toolchain.
PACKAGES = gcc libc6-dev libclang-dev
# What the window opens at run time.
PACKAGES += libgl1 libegl1 libgl1-mesa-dri libxkbcommon-x11-0 libxcursor1 libxi6 libxrandr2
# What the tests on the kernel's own camera drivers need besides (tests/vm).
VM_PACKAGES = qemu-system-x86 busybox-static cpio zstd xz-utils kmod binutils python3


.PHONY: run test test-vm setup lint bench sessions

run: setup
	cargo run --release --quiet -- $(ARGS)

test: PACKAGES += $(VM_PACKAGES)
test: setup lint
	cargo test
	tests/vm/run.sh

# The camera on the kernel's own drivers, in a small virtual machine; needs neither root nor KVM.
test-vm: PACKAGES += $(VM_PACKAGES)
test-vm: setup
	tests/vm/run.sh

lint:
	cargo fmt --check
	cargo clippy --all-targets --quiet -- -D warnings

bench: setup
	cargo bench

setup:
	@command -v cargo >/dev/null || { echo "boresight needs a Rust toolchain (1.95 or newer): see https://rustup.rs"; exit 1; }
	@missing=$$(for p in $(PACKAGES); do dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || echo $$p; done); \
	if [ -n "$$missing" ]; then \
		echo "Installing from Debian:" $$missing; \
		if [ "$$(id -u)" = 0 ]; then SUDO=; else SUDO=sudo; fi; \
		$$SUDO apt-get update -qq && $$SUDO apt-get install -y --no-install-recommends $$missing; \
	fi
