# What one types in this project. `make` alone lists it.
#
# Everything is built with the release profile: PROJ, which takes minutes, compiles once for the
# demo, the tests, the lints and the benchmarks.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.NOTPARALLEL:
.DEFAULT_GOAL := help

# On a build server the compiled dependencies are kept from one run to the next. A server without
# that folder builds them again.
ifdef CI
export CARGO_TARGET_DIR ?= $(HOME)/.cache/rockmap/target
endif

CARGO ?= cargo
ROCKMAP := $(CARGO) run --release --quiet --

# Programs that tests and documentation need and that come from crates.io.
TOOLS ?= $(HOME)/.cache/rockmap/tools
CARGO_DENY_VERSION := 0.20.2
MDBOOK_VERSION := 0.5.4

.PHONY: help deps tools demo test lint bench docs acceptance clean

help: ## List the targets
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

deps: ## Install the system packages the build needs, where they are missing
	@.ci/deps

tools: ## Install cargo-deny and mdbook into the cache folder, where they are missing
	@.ci/tool "$(TOOLS)" cargo-deny "$(CARGO_DENY_VERSION)"
	@.ci/tool "$(TOOLS)" mdbook "$(MDBOOK_VERSION)" --no-default-features --features search

demo: deps ## Simulate a traverse, map it, and say which files to open
	$(CARGO) build --release
	$(ROCKMAP) simulate fixtures/scenes/demo.toml --out outputs/demo-data
	$(ROCKMAP) project pipelines/demo.toml --out outputs/demo-single --force
	$(ROCKMAP) run pipelines/demo.toml --force
	@echo
	@echo 'Open'
	@echo '  outputs/demo/rockmap.qgz                the map in QGIS, styled'
	@echo '  outputs/demo/report.html                the map in a browser, with what every rock rests on'
	@echo '  outputs/demo/rocks.geojson              every rock once, for any other GIS'
	@echo '  outputs/demo/ellipses.geojson           where each rock lies with 95 % probability'
	@echo '  outputs/demo/annotated/                 the map drawn back into every picture'
	@echo '  outputs/demo-single/detections.geojson  before fusion: every detection by itself'

test: deps tools lint docs ## Run every check: format, lints, licences, documentation, tests
	$(CARGO) test --release

lint: deps tools ## Check format, lints and licences
	@$(CARGO) fmt --version >/dev/null 2>&1 || rustup component add rustfmt
	@$(CARGO) clippy --version >/dev/null 2>&1 || rustup component add clippy
	$(CARGO) fmt --check
	$(CARGO) clippy --release --all-targets -- -D warnings
	"$(TOOLS)/bin/cargo-deny" check --hide-inclusion-graph licenses bans sources

bench: deps ## Run the benchmarks, and the cameras beside OpenCV where Python has it
	$(CARGO) bench
	@if python3 -c 'import cv2, tomllib' 2>/dev/null; then python3 benches/camera.py; \
	else echo 'no comparison with OpenCV: python3 has no cv2 (pip install opencv-python-headless)'; fi

docs: deps tools ## Build the book into docs/book and the library's reference
	"$(TOOLS)/bin/mdbook" build docs
	.ci/links
	RUSTDOCFLAGS='-D warnings' $(CARGO) doc --release --no-deps

acceptance: demo ## Open the demo's files with GDAL, GeoPandas, QGIS and Chromium; run the real data that is at hand
	@.ci/acceptance

clean: ## Remove what was built and what runs have written
	$(CARGO) clean
	rm -rf docs/book
	find outputs -mindepth 1 ! -name README.md -delete
