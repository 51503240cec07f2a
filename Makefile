# make demo   render the built-in scenes for several displays into demo/
# make test   install what is missing, check style, types and the import law, run all tests
# make bench  measure meshes, volumes, points and the papers' tables (bench-*.json); needs the peers of `pip install .[bench]`
# make clean  remove what the others made

PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
SOURCES := $(shell find src -name '*.py' -o -name '*.toml')

.PHONY: demo test lint bench clean

demo: $(VENV)/run
	$(BIN)/autostereo demo -o demo

test: lint
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest -q -n auto --maxprocesses 4 tests/test_nojit.py
	$(BIN)/python -m pytest -n auto --maxprocesses 4 --dist loadfile

lint: $(VENV)/dev
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/bench
	$(BIN)/autostereo bench mesh --json bench-mesh.json
	$(BIN)/autostereo bench volume --json bench-volume.json
	$(BIN)/autostereo bench points --json bench-points.json
	$(BIN)/autostereo bench papers --json bench-papers.json

clean:
	rm -rf $(VENV) demo build bench-*.json .pytest_cache .hypothesis .mypy_cache .ruff_cache .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# --- the environments: one folder, three depths; an editable installation (dev) is always current ---------------
$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10) and "autostereo needs Python 3.10 or newer")'
	$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); echo 'the venv module is missing: install python3-venv' >&2; exit 1; }

$(VENV)/run: $(BIN)/python pyproject.toml $(SOURCES)
	@[ -e $(VENV)/dev ] || $(BIN)/python -m pip install --quiet --disable-pip-version-check .
	@touch $@

$(VENV)/dev: $(BIN)/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $@

$(VENV)/bench: $(VENV)/dev
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[bench]'
	@touch $@
