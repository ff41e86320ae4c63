# Set-up and the main jobs. Each target makes the virtual environment it needs; nothing else has to be installed
# but Python 3.11 or later and make.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= out
EXAMPLE ?= examples/durango-fourbar.yaml

.PHONY: demo test test-all bench docs clean types pages found

# What is imported is compiled once, not by each of the hundreds of processes that tests start.
unexport PYTHONDONTWRITEBYTECODE

# The main job on a real example: a table on the screen, and report, CSV and figures in $(OUT).
demo: $(VENV)/.base
	@mkdir -p $(OUT)
	$(BIN)/trunnion analyse $(EXAMPLE) --out $(OUT)/four-bar.csv --report $(OUT)/four-bar.html
	$(BIN)/trunnion plot $(EXAMPLE) --out $(OUT)
	@echo "open $(OUT)/four-bar.html in a browser"

# Lint, types, layer rule, the text and links of the documentation, tests: some minutes.
test: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(MAKE) --no-print-directory --jobs=2 types pages found
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "not slow"

types: $(VENV)/.dev
	$(BIN)/mypy

# Beside the types: layers, the text of the documentation.
pages: $(VENV)/.dev
	$(BIN)/lint-imports
	NO_MKDOCS_2_WARNING=1 TRUNNION_DOCS=text $(BIN)/mkdocs build --strict --quiet --site-dir $(VENV)/site

# Beside whichever of these two takes longer: finding the tests, which compiles them for both processes.
found: $(VENV)/.dev
	@$(BIN)/python -m pytest --collect-only -qq > $(VENV)/tests-found 2>&1 || { cat $(VENV)/tests-found; exit 1; }

# What `make test` leaves out: every example, long counts, further oracles, every page of the documentation.
test-all: $(VENV)/.dev
	$(BIN)/python -m pytest -n 2 --dist worksteal -m slow --durations=20 --durations-min=10

# Ratios to peers and hand-written kernels, measured in one run.
bench: $(VENV)/.bench
	$(BIN)/python -m benchmarks.run

# The documentation in site/, with all figures: two minutes, less when little has changed since the last time.
docs: $(VENV)/.dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

clean:
	rm -rf $(VENV) $(OUT) site .docs-cache dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find src tests benchmarks -name __pycache__ -prune -exec rm -rf {} +

$(VENV)/.made:
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or later is needed" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.base: $(VENV)/.made pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(VENV)/.dev: $(VENV)/.made pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

$(VENV)/.bench: $(VENV)/.made pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[bench]'
	@touch $@
