# Everything runs in .venv, which is made from pyproject.toml and made again when that changes.

PYTHON ?= python3
BIN := .venv/bin
MADE := .venv/.made-from-pyproject
SAMPLE := missions/survey-vineyard.plan

.PHONY: help setup demo test lint types layers unit bench format golden readme clean

help: ## say what can be made
	@grep -E '^[a-z]+:.*##' Makefile | sed -E 's/:.*## /\t/' | expand -t 10

setup: $(MADE) ## make or renew the environment

$(MADE): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "mavjoule needs Python 3.11 or later: make PYTHON=python3.11")'
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1'
	$(BIN)/python -m pip install --quiet --editable . --group dev
	@touch $@

demo: $(MADE) ## check a sample mission
	@$(BIN)/mavjoule check $(SAMPLE)
	@echo
	@echo "Try next:"
	@echo "  $(BIN)/mavjoule check missions/crossing-too-far.plan    a no-go, and why"
	@echo "  $(BIN)/mavjoule segments $(SAMPLE)  the flight, segment by segment"
	@echo "  $(BIN)/mavjoule check YOUR.plan --battery 5.2Ah@14.8V   your own mission"

test: lint types layers unit ## the whole gate

lint: $(MADE)
	$(BIN)/ruff format --check
	$(BIN)/ruff check

types: $(MADE)
	$(BIN)/mypy

layers: $(MADE)
	$(BIN)/lint-imports

unit: $(MADE)
	$(BIN)/pytest -q -n 2

bench: $(MADE) ## measure what has to be fast
	$(BIN)/pytest -q -s -m bench tests/bench

format: $(MADE) ## put the code in shape
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

golden: $(MADE) ## write the sample reports in tests/report/golden anew
	$(BIN)/python tests/report/test_golden.py

readme: $(MADE) ## write the help and sample output in README.md anew
	$(BIN)/python tests/project/test_readme.py

clean: ## remove the environment and every cache
	rm -rf .venv dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
