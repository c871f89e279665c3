# make demo   the talk's study and a depth-of-field comparison at a small size, then out/index.html
# make docs   the documentation as a site
# make test   what CI runs; make test-all adds the slow tests and prints the coverage of lines and branches
# make wheel  a wheel for this machine, tested as installed
# make test-oldest   the tests of make test with the lowest versions that pyproject.toml admits
# Another Python, in an environment of its own: make test PYTHON=python3.13 VENV=.venv-3.13
# Every target makes what it needs first: .venv, the installed package, libLLVM, Clang for the C++ tests,
# Chromium for the browser tests, a compiler for WebAssembly for the live figure.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
BUILD := 'scikit-build-core>=0.11' 'nanobind>=2.4' 'cmake>=3.18,<4.2' 'ninja>=1.5'
export PIP_DISABLE_PIP_VERSION_CHECK := 1

# Of x86-64, that the core is compiled for: for developers all, for the demo what this machine needs
LEVELS ?= all
demo: export LEVELS := this-machine
# A stamp for each: with the core for this machine only, there is still all to be built
READY := $(VENV)/.ready-$(LEVELS)

CORE := $(shell find include src/bindings -name '*.[ch]pp') CMakeLists.txt
CPP := $(shell find include src/bindings src/live tests/cpp examples/cpp -name '*.[ch]pp')

.PHONY: install built llvm clang chromium wasm demo demo-programs test test-all test-oldest wheel lint format docs figures clean

install: $(VENV)/.installed

# The package and what it depends on, without extras
built: $(READY)

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "voroquad needs Python 3.11 or newer; name one: make PYTHON=python3.11"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' || { echo "Python lacks venv: apt-get install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(READY): $(BIN)/python pyproject.toml $(CORE)
	@command -v $${CXX:-c++} >/dev/null || { echo "voroquad needs a C++20 compiler: apt-get install g++"; exit 1; }
	$(BIN)/pip install -q $(BUILD)
	$(BIN)/pip install -q --no-build-isolation --no-deps -C cmake.define.VOROQUAD_LEVELS=$(LEVELS) -e .
	$(BIN)/pip install -q voroquad # of the one just installed; sdists among these bring their own build tools
	@rm -f $(VENV)/.ready-* # of what this one has replaced
	@touch $@ $(VENV)/.ready-this-machine # which is among all

$(VENV)/.installed: $(READY)
	$(BIN)/pip install -q 'voroquad[dev]'
	@touch $@

# What the demo needs; all of it is among what developers have
$(VENV)/.demo: $(READY)
	$(BIN)/pip install -q 'voroquad[render]'
	@touch $@

llvm:
	@scripts/ensure-llvm.sh

clang:
	@scripts/ensure-clang.sh

chromium:
	@scripts/ensure-chromium.sh

# The live figure: the core in WebAssembly, in a page that the documentation and the demo show
wasm: $(READY)
	@scripts/ensure-wasm.sh
	$(BIN)/python scripts/make_live.py

# Packages of the system and of Python are installed at the same time
demo:
	@$(MAKE) --no-print-directory -j 2 demo-programs $(VENV)/.demo
	@$(MAKE) --no-print-directory wasm
	$(BIN)/voroquad demo -o out

demo-programs:
	@scripts/ensure-llvm.sh
	@scripts/ensure-wasm.sh

# Two processes of one thread each: threads of both on the same cores would wait for one another
ONE_THREAD := VOROQUAD_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
PYTEST := -m pytest -n 2 --dist worksteal

test: install llvm clang chromium wasm lint
	$(ONE_THREAD) $(BIN)/python $(PYTEST) -m 'not slow'

# The programs that tests start are measured too, and all is put together
test-all: install llvm clang chromium wasm lint
	$(BIN)/coverage erase
	$(ONE_THREAD) $(BIN)/coverage run $(PYTEST)
	$(BIN)/coverage combine -q
	$(BIN)/coverage report

OLDEST := .venv-oldest
UV := $(OLDEST)/bin/uv pip install -q --python $(OLDEST)/bin/python --resolution lowest-direct

test-oldest: llvm clang chromium
	$(PYTHON) -m venv --clear $(OLDEST)
	$(OLDEST)/bin/pip install -q uv # which can resolve to the lowest versions
	$(UV) $(BUILD)
	$(UV) --no-build-isolation --no-deps -C build-dir=build/oldest -C cmake.define.VOROQUAD_LEVELS=all -e .
	$(UV) -r pyproject.toml --extra dev
	$(ONE_THREAD) $(OLDEST)/bin/python $(PYTEST) -m 'not slow'

# A wheel for this machine, in build/wheels, tested as installed
wheel: wasm
	scripts/build-wheel.sh $(PYTHON)

lint: install
	$(BIN)/ruff check -q .
	$(BIN)/ruff format -q --check .
	$(BIN)/clang-format --dry-run --Werror $(CPP)
	$(BIN)/mypy

format: install
	$(BIN)/ruff format -q .
	$(BIN)/ruff check -q --fix .
	$(BIN)/clang-format -i $(CPP)

# The documentation as a site, build/docs/index.html; a warning is an error
docs: install wasm
	$(BIN)/sphinx-build -q -W --keep-going -b html docs build/docs

# The pictures and numbers of README and docs, measured anew
figures: install llvm
	$(BIN)/voroquad study -o build/figures/study
	$(BIN)/voroquad compare depth-of-field -o build/figures/compare
	$(BIN)/python examples/mri_density.py -o build/figures/mri
	for example in brillouin_zone declustering particles peaks rain_gauges stack_of_spirals; do $(BIN)/python examples/$$example.py -o docs/figures || exit 1; done
	$(BIN)/python scripts/publish_figures.py build/figures

clean:
	rm -rf build out $(VENV) $(OLDEST)
