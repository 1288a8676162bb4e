# Two commands do everything: `make demo` and `make test`. They need Python >= 3.11 and make.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
RUN_STAMP := $(VENV)/.installed-run
DEV_STAMP := $(VENV)/.installed-dev
TRUTH_STAMP := $(VENV)/.installed-truth
DOCS_STAMP := $(VENV)/.installed-docs
# One BLAS thread for each process: the tests and learners run many small problems side by side.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
export MKL_NUM_THREADS ?= 1
WORKERS ?= 2
DATA ?= ../shared/real

.PHONY: demo test test-all lint docs bench clean

demo: $(RUN_STAMP)
	$(BIN)/unmodeled characterize scenarios/bennu-demo.yaml --out runs/bennu-demo
	$(BIN)/unmodeled diagnose cases/bennu-orbiter/case.yaml --auto --out runs/bennu-orbiter

test: $(DEV_STAMP)
	$(BIN)/python -m pytest -q -n $(WORKERS) --dist loadgroup -m "not slow"

test-all: $(DEV_STAMP) $(TRUTH_STAMP)
	UNMODELED_DATA=$(DATA) $(BIN)/python -m pytest -q -n $(WORKERS) --dist loadgroup

lint: $(DEV_STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(DOCS_STAMP)
	$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

bench: $(DEV_STAMP)
	$(BIN)/python benchmarks/collision_screening.py
	$(BIN)/python benchmarks/robustness_pairs.py
	$(BIN)/python benchmarks/diagnosis_speed.py
	$(BIN)/python benchmarks/skill_table.py --small
	$(BIN)/python benchmarks/hidden_effects/suite.py --workers 2
	$(BIN)/python benchmarks/hidden_effects/summary.py

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit("unmodeled needs Python >= 3.11, found " + sys.version.split()[0]) if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)

$(RUN_STAMP): pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) install -q -c constraints.txt -e .
	@touch $@

$(DEV_STAMP): pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) install -q -c constraints.txt -e ".[dev]"
	@touch $@ $(RUN_STAMP)

$(TRUTH_STAMP): pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) install -q -c constraints.txt -e ".[truth,planets]"
	@touch $@

$(DOCS_STAMP): pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) install -q -c constraints.txt -e ".[docs]"
	@touch $@

clean:
	rm -rf $(VENV) runs build dist docs/_build
