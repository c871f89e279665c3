# make demo   the talk's study and a depth-of-field comparison at a small size, then out/index.html
# make docs   the documentation as a site
# make test   what CI runs; make test-all adds the slow tests
# Every target makes what it needs first: .venv, the installed package, libLLVM, Clang for the C++ tests,
# Chromium for the browser tests.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
export PIP_DISABLE_PIP_VERSION_CHECK := 1

CORE := $(shell find include src/bindings -name '*.[ch]pp') CMakeLists.txt
CPP := $(shell find include src/bindings tests/cpp examples/cpp -name '*.[ch]pp')

.PHONY: install llvm clang chromium demo test test-all lint format docs figures clean

install: $(VENV)/.installed

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "voroquad needs Python 3.11 or newer; name one: make PYTHON=python3.11"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' || { echo "Python lacks venv: apt-get install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: $(BIN)/python pyproject.toml $(CORE)
	@command -v $${CXX:-c++} >/dev/null || { echo "voroquad needs a C++20 compiler: apt-get install g++"; exit 1; }
	$(BIN)/pip install -q 'scikit-build-core>=0.10' 'nanobind>=2.4' 'cmake>=3.18,<4.2' ninja
	$(BIN)/pip install -q --no-build-isolation --no-deps -e .
	$(BIN)/pip install -q 'voroquad[dev]' # of the one just installed; sdists among these bring their own build tools
	@touch $@

llvm: $(BIN)/python
	@PYTHON=$(BIN)/python scripts/ensure-llvm.sh

clang:
	@scripts/ensure-clang.sh

chromium:
	@scripts/ensure-chromium.sh

demo: install llvm
	$(BIN)/voroquad demo -o out

# Two processes of one thread each: threads of both on the same cores would wait for one another
PYTEST := VOROQUAD_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist worksteal

test: install llvm clang chromium lint
	$(PYTEST) -m 'not slow'

test-all: install llvm clang chromium lint
	$(PYTEST)

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
docs: install
	$(BIN)/sphinx-build -q -W --keep-going -b html docs build/docs

# The pictures and numbers of README and docs, measured anew
figures: install llvm
	$(BIN)/voroquad study -o build/figures/study
	$(BIN)/voroquad compare depth-of-field -o build/figures/compare
	$(BIN)/python examples/mri_density.py -o build/figures/mri
	$(BIN)/python scripts/publish_figures.py build/figures

clean:
	rm -rf build out $(VENV)
