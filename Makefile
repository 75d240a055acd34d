# make demo: dress the dummy.  make test: all checks.  make setup: install only.
# make docs: the site, build/docs/index.html.  make docs-links: its links to other sites.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin

.PHONY: setup demo test lint style duplicates format coverage docs docs-links clean

setup: $(VENV)/.installed

demo: setup
	$(BIN)/drake-dress run scenarios/dummy_standing.yaml \
	    --set station.arms.model=panda --set controller.method=full

# One thread for each of the processes side by side; what meets in real time runs by itself.
test: $(VENV)/.installed-test style
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -m 'not alone' \
	    --numprocesses logical --maxprocesses 4 --dist worksteal
	$(BIN)/python -m pytest -m alone

# Which test file covers a module that has none of its own: tests/covered_by.json.
coverage: $(VENV)/.installed-test
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[coverage]'
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -m 'not alone' \
	    --numprocesses logical --maxprocesses 4 --dist worksteal \
	    --cov drake_dress --cov benchmarks --cov-context test --cov-report=
	$(BIN)/python -m tests.covered_by

lint: style duplicates

style: $(VENV)/.installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# Code that is written twice, six lines or more; takes two minutes.
duplicates: $(VENV)/.installed-test
	$(BIN)/pylint --jobs 2 --score n drake_dress

format: $(VENV)/.installed-test
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# Warnings are errors: a link or a reference that leads nowhere fails.
docs: $(VENV)/.installed-docs
	$(BIN)/python -m sphinx -b html -W --keep-going -q -d build/doctrees docs build/docs
	@echo "build/docs/index.html"

docs-links: $(VENV)/.installed-docs
	$(BIN)/python -m sphinx -b linkcheck -W --keep-going -q -d build/doctrees docs build/docs-links

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || \
	    { echo "Python 3.11 is needed; set PYTHON=/path/to/python3.11"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' || \
	    { echo "Python's venv is missing: apt-get install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)

# torch first and by its exact pin: anything looser brings gigabytes of CUDA.
$(VENV)/.installed: pyproject.toml constraints.txt | $(BIN)/python
	$(BIN)/python -m pip install --quiet torch==2.13.0
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[torch,vision]'
	touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[test]'
	touch $@

$(VENV)/.installed-docs: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[docs]'
	touch $@

clean:
	rm -rf $(VENV) out build docs/reference docs/scenario_keys.md .mypy_cache .ruff_cache .hypothesis
