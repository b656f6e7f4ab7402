# Needs Python >= 3.10 (with venv and its C headers), a C++17 compiler and make. The rest goes into .venv.
#   make walk                      set up, walk the hexapod of S2 for 10 s, leave walk.nc and walk.html
#   make test                      set up, run every test
#   make sanitize                  the core under address, undefined-behaviour and thread sanitizers
#   make fuzz                      100 000 odd inputs through every public door, 5000 as processes; under an hour
#   make docs                      the documentation site into build/site, examples and notebooks executed
#   make wheel                     build a wheel into dist/; wheel-smoke tries it where no compiler is
#   make PYTHON=python3.12 CXX=clang++ walk

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := walk
.DELETE_ON_ERROR:

ifeq ($(origin CXX),default)
CXX := $(firstword $(foreach name,g++ c++ clang++,$(if $(shell command -v $(name)),$(name))) g++)
endif
export CXX

PYTHONS := $(or $(PYTHON),python3 python3.13 python3.12 python3.11 python3.10 python3.14)
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
# Without byte code for all of it: Python writes that of the modules it comes to use.
INSTALL := $(PIP) install --no-compile
BUILD_REQUIRES := "pip>=23" "scikit-build-core>=0.10" "nanobind>=2.4" "libpinocchio==4.1.*" \
	cmeel-eigen cmeel-urdfdom-headers typing_extensions ninja cmake
# The run-time dependencies, one a line; scikit-build-core brings tomli where Python has no tomllib.
DEPENDENCIES := import importlib, sys; \
toml = importlib.import_module("tomllib" if sys.version_info >= (3, 11) else "tomli"); \
project = toml.load(open("pyproject.toml", "rb"))["project"]; \
print(*project["dependencies"], *project["optional-dependencies"]["plot"], sep="\n")
NATIVE := CMakeLists.txt $(sort $(shell find hexapod_pin/native -name '*.[ch]pp'))
STUB := hexapod_pin/native/_core.pyi
MODULES := $(sort $(shell find hexapod_pin -name '*.py'))

# Each probe ends with one line that says what is missing, or silently with status 0.
PROBE := import sys; v = sys.version_info; \
v >= (3, 10) or sys.exit("is Python %d.%d; 3.10 or newer is needed" % v[:2]); \
import importlib.util as u, os, sysconfig; \
all(map(u.find_spec, ("venv", "ensurepip"))) or sys.exit("lacks venv/ensurepip: install python3-venv"); \
os.path.exists(sysconfig.get_path("include") + "/Python.h") or sys.exit("lacks Python.h: install python3-dev")
PROGRAM := \#include <optional>\nint main() { if constexpr (true) return *std::optional<int>(0); }\n

.PHONY: walk test lint format types contracts check sanitize fuzz bench docs wheel wheel-smoke clean compiler FORCE

walk: $(VENV)/.installed
	@$(BIN)/hexapod-pin walk kharagpur --out walk.nc --html walk.html

test: $(VENV)/.test
	$(BIN)/python -m pytest -n auto --dist worksteal

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

format: $(VENV)/.dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

types: $(STUB)
	$(BIN)/mypy --num-workers auto

# The types of the compiled module, read from it: an editable install keeps them out of this folder.
$(STUB): $(VENV)/.dev
	@$(BIN)/python -m nanobind.stubgen -q -m hexapod_pin.native._core -o $@

contracts: $(VENV)/.dev
	$(BIN)/lint-imports

check: lint types contracts test
	$(BIN)/python scripts/build_urdf.py --check

sanitize: $(VENV)/.dev
	$(BIN)/python scripts/sanitize.py address,undefined
	$(BIN)/python scripts/sanitize.py thread

fuzz: $(VENV)/.test
	$(BIN)/python tests/fuzz --inputs 95000 --commands 5000

bench: $(VENV)/.test
	$(BIN)/python scripts/studies step_cost

docs: build/executed/.done $(VENV)/.docs
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "wrote build/site/index.html"

# What examples and notebooks print and draw; they run again where one of them or the package has changed.
build/executed/.done: $(VENV)/.docs $(wildcard examples/*.* notebooks/*.ipynb) $(MODULES) $(NATIVE)
	@echo "executing examples and notebooks, some minutes"
	@$(BIN)/python scripts/documentation/execute.py build/executed
	@touch $@

wheel: $(VENV)/.build | compiler
	@rm -f dist/hexapod_pin-*.whl
	@PATH="$(CURDIR)/$(BIN):$$PATH" $(PIP) wheel --no-deps --no-build-isolation --wheel-dir dist .
	@ls dist/hexapod_pin-*.whl

# In a fresh environment, an empty folder, and a PATH that holds nothing but that environment.
wheel-smoke: wheel
	@wheel="$$(ls "$(CURDIR)"/dist/hexapod_pin-*.whl)"; folder="$$(mktemp -d)"; trap 'rm -rf "$$folder"' EXIT; \
	python="$(CURDIR)/$(BIN)/python"; cd "$$folder"; "$$python" -m venv fresh; mkdir empty; \
	fresh/bin/python -m pip --disable-pip-version-check --quiet install --no-compile "$$wheel"; \
	( cd empty; export PATH="$$folder/fresh/bin"; unset PYTHONPATH; \
	for tool in cc c++ gcc g++ clang make cmake ninja; do \
	  if command -v "$$tool"; then echo "hexapod_pin: $$tool is on the PATH of the smoke test" >&2; exit 1; fi; done; \
	python -c "import hexapod_pin; print(hexapod_pin.__file__)"; \
	hexapod-pin walk kharagpur --duration 1 --no-html )

clean:
	rm -rf $(VENV) $(STUB) build dist .mypy_cache .pytest_cache .ruff_cache .import_linter_cache
	find hexapod_pin scripts tests examples -name __pycache__ -prune -exec rm -rf {} +

compiler:
	@printf '$(PROGRAM)' | $(CXX) -std=c++17 -fsyntax-only -x c++ - 2>/dev/null || \
	{ echo "hexapod_pin: no working C++17 compiler ($(CXX)): install g++ 8 or newer, or name one: make CXX=..." >&2; exit 1; }

$(VENV)/.python: | compiler
	@reason=; for name in $(PYTHONS); do \
	  if said=$$($$name -c '$(PROBE)' 2>&1); then python=$$name; break; fi; \
	  if command -v "$$name" >/dev/null && [[ $$said == is\ * || $$said == lacks\ * ]]; then \
	    reason=$${reason:-"$$name $$said"}; fi; done; \
	if [[ -z $${python:-} ]]; then \
	  echo "hexapod_pin: no usable Python: $${reason:-none of $(PYTHONS) runs; 3.10 or newer is needed}, or name one: make PYTHON=..." >&2; \
	  exit 1; fi; \
	echo "setting up $(VENV) with $$("$$python" --version)"; \
	"$$python" -m venv --clear $(VENV); \
	touch $@

$(VENV)/.build: $(VENV)/.python
	@echo "installing the build tools and Pinocchio"
	@$(INSTALL) $(BUILD_REQUIRES)
	@touch $@

# An editable install knows its modules by name: a new or moved one needs another install.
$(VENV)/.modules: $(VENV)/.build FORCE
	@echo "$(MODULES)" | cmp --quiet - $@ || echo "$(MODULES)" > $@

# The dependencies are installed while the core is compiled: no package is touched by both.
$(VENV)/.installed: $(VENV)/.build $(VENV)/.modules pyproject.toml $(NATIVE) | compiler
	@echo "installing hexapod_pin; the first time the native core is compiled, one to three minutes"
	@$(INSTALL) -r <($(BIN)/python -c '$(DEPENDENCIES)') & dependencies=$$!; \
	PATH="$(CURDIR)/$(BIN):$$PATH" $(INSTALL) --no-build-isolation --check-build-dependencies --no-deps -e . || \
	{ kill $$dependencies; exit 1; }; \
	wait $$dependencies
	@touch $@

$(VENV)/.test: $(VENV)/.installed
	@echo "installing what the tests need"
	@$(INSTALL) "hexapod-pin[test]"
	@touch $@

$(VENV)/.docs: $(VENV)/.test
	@echo "installing what the documentation needs"
	@$(INSTALL) "hexapod-pin[docs]"
	@touch $@

$(VENV)/.dev: $(VENV)/.test
	@echo "installing ruff, mypy and import-linter"
	@$(INSTALL) "hexapod-pin[dev]"
	@touch $@
