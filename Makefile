# `make demo` installs what is missing, runs a first case and draws it; `make test` checks everything.
# Needs Debian 12 or 13, or Ubuntu 26.04 or later, with git and make; `setup` fetches the rest. What is up to date is
# not done again. `make setup PIP=1` takes DOLFINx from PyPI instead and needs no root: a compiler and Python 3.12 or later.

SHELL  := /bin/bash
BIN    := .venv/bin

# The MPI of PyPI's DOLFINx comes with it.
export PATH := $(CURDIR)/$(BIN):$(PATH)

ifdef PIP
PYTHON       := $(firstword $(foreach v,3.14 3.13 3.12,$(shell command -v python$(v) 2>/dev/null)) python3)
VENV_OPTIONS :=
DOLFINX      := dolfinx-solver-real h5py scipy
else
PYTHON       := /usr/bin/python3
VENV_OPTIONS := --system-site-packages
DOLFINX      :=
endif

DEBIAN_PACKAGES := \
  build-essential cmake ninja-build python3-venv python3-dev \
  python3-dolfinx python3-petsc4py python3-mpi4py python3-h5py python3-h5py-mpi python3-scipy libopenblas0-pthread \
  libosmesa6 libegl1 libgl1 libglu1-mesa libxrender1 libxft2 libxcursor1 libxinerama1 libxfixes3

# One thread per process. Open MPI: as root, on few or shared cores (processes that do not move made two parallel tests at
# a time 2 to 10 times slower), and without complaints about shared memory in containers.
export OPENBLAS_NUM_THREADS ?= 1
export OMPI_ALLOW_RUN_AS_ROOT ?= 1
export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM ?= 1
export OMPI_MCA_rmaps_base_oversubscribe ?= 1
export PRTE_MCA_rmaps_default_mapping_policy ?= :oversubscribe
export OMPI_MCA_hwloc_base_binding_policy ?= none
export OMPI_MCA_btl_vader_single_copy_mechanism ?= none
export PYVISTA_OFF_SCREEN ?= true

PACKAGES_STAMP := .venv/debian-packages.stamp
PROJECT_STAMP  := .venv/project.stamp
DOCS_STAMP     := .venv/docs.stamp
MODULES        := .venv/modules.txt
KERNEL_SOURCES := $(wildcard solvers/kernels/CMakeLists.txt solvers/kernels/*.hpp solvers/kernels/*.cpp solvers/kernels/*.map)
VERSION_TESTS  := fem versions lagged linear moments_kernel mortar_kernel nodal_normals mortar_derivatives structure_patch \
  fluid_patch contact_patch contact_system contact_run contact_friction coupling_bar coupling_blocks coupled_run \
  ogden
INSTALL        := $(BIN)/pip install --quiet --disable-pip-version-check --no-build-isolation

.PHONY: setup demo test test-slow test-versions test-debian13 coverage lint bench docs links clean FORCE

setup: $(PROJECT_STAMP)

$(PACKAGES_STAMP): Makefile .ci/install-packages
	$(if $(PIP),,.ci/install-packages $(DEBIAN_PACKAGES))
	@mkdir -p .venv && touch $@

# An installed module is found where it was: one that came, went or moved since needs a new installation.
$(MODULES): FORCE
	@mkdir -p .venv
	@find fsci solvers coupling -name '*.py' | sort > $@.new
	@cmp -s $@.new $@ && rm $@.new || mv $@.new $@

$(PROJECT_STAMP): pyproject.toml $(KERNEL_SOURCES) $(MODULES) | $(PACKAGES_STAMP)
	@test -x $(BIN)/pip || $(PYTHON) -m venv $(VENV_OPTIONS) .venv
	@echo "setup: building and installing fsci into .venv"
	$(INSTALL) nanobind scikit-build-core cmake ninja $(DOLFINX)
	$(INSTALL) --editable '.[test]'
	@$(BIN)/python -c 'from solvers.fem import calls'
	@touch $@

$(DOCS_STAMP): pyproject.toml | $(PROJECT_STAMP)
	$(INSTALL) --editable '.[docs]'
	@touch $@

demo: setup
	mpirun -n 2 $(BIN)/fsci run cases/torus_wall -o results/torus_wall
	$(BIN)/fsci plot results/torus_wall --movie
	@echo "Pictures are in results/torus_wall/pictures/, fields for ParaView in results/torus_wall/fields/."

# A worker that has nothing left takes tests from the other one. As xdist begins otherwise, the first worker gets an eighth of
# the tests at once: all of tests/cases and tests/coupling, which are half of the time.
PARALLEL := -n 2 --dist worksteal

test: setup lint
	$(BIN)/python -m pytest $(PARALLEL) -m "not slow"

# MINUTES=30 begins no test after half an hour and names those that are left out.
test-slow: setup
	$(BIN)/python -m pytest $(PARALLEL) -m slow --durations=10 $(MINUTES:%=--minutes=%)

# What versions of DOLFINx, PETSc, MPI and numpy may break.
test-versions: setup
	$(BIN)/python -m pytest $(PARALLEL) -m "not slow" $(VERSION_TESTS:%=tests/*/test_%.py)
	$(BIN)/python -m pytest -m slow tests/cases/test_versions.py

# Lines of solvers and coupling that the quick tests run, by file; it takes half as long again as the tests.
coverage: setup
	$(BIN)/coverage erase
	$(BIN)/coverage run -m pytest $(PARALLEL) -m "not slow"
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report

# The same in a Debian 13 that is made for it, as root.
test-debian13:
	.ci/test-debian13

lint: setup
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/lint-imports --no-logo
	@if $(BIN)/python -c 'import numpy; raise SystemExit(numpy.__version__ >= "2")'; then echo $(BIN)/mypy && $(BIN)/mypy; \
	else echo "lint: types are checked on Debian 12; those that numpy 2 and newer petsc4py declare differ"; fi

bench: setup
	$(BIN)/fsci bench all

docs: $(DOCS_STAMP)
	mkdir -p docs/reference
	$(BIN)/fsci schema --markdown > docs/reference/case.md
	$(BIN)/fsci schema > docs/reference/fsci.schema.json
	$(BIN)/python docs/make_api.py > docs/reference/api.md
	$(BIN)/python docs/make_constants.py > docs/reference/constants.md
	$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_build/html
	@echo "Open docs/_build/html/index.html"

# External links of the pages and of the README. Internal ones are checked by a test.
links: docs
	@if $(BIN)/python -c 'import socket; socket.create_connection(("github.com", 443), 10)' 2>/dev/null; then \
	  printf -- '---\norphan: true\n---\n\n```{include} ../../README.md\n:relative-docs: docs/\n```\n' > docs/reference/readme.md; \
	  $(BIN)/python -m sphinx -q -b linkcheck -D suppress_warnings=myst.xref_missing,image.not_readable docs docs/_build/links; status=$$?; rm docs/reference/readme.md; exit $$status; \
	else echo "links: no connection to github.com, external links are not checked"; fi

# Back to a fresh clone, except for results/: they may have taken days.
clean:
	rm -rf .venv build docs/_build docs/reference/{api,constants}.md docs/reference/fsci.schema.json .coverage .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -prune -exec rm -rf {} +
