# SPDX-License-Identifier: Apache-2.0
# `make run` and `make test` are the two to know; each works on a fresh clone and makes .venv itself.

PYTHON ?= python3
PY     := .venv/bin/python
TAPE   ?= tapes/sink_shallow_deep.nc
# Options for gapkeeper run, e.g. make run OPTIONS="--seed 2 --waves"
OPTIONS ?=
# Options for pytest, e.g. make test TESTS="-k tape"
TESTS   ?=
JOBS    ?= auto
# Some tests wait for another process: a worker more than there are processors.
WORKERS := $(if $(filter auto,$(JOBS)),$(shell expr $$(getconf _NPROCESSORS_ONLN) + 1),$(JOBS))
BOARDS  ?= ulx3s ulx3s_45f colorlight_i9
# Folder of another version whose speed is measured beside this one's, and options:
# git worktree add ../old 8563506 && make bench BESIDE="../old --until 8"
BESIDE  ?=
# Options for the fault campaign, e.g. make faults FAULTS="--only F3 --seed 2"
FAULTS  ?=

.PHONY: help run test check install venv bench boards soak faults lint docs clean

help:     ## this list
	@sed -n 's/^\([a-z]*\):[^#]*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 18

run: install   ## punch a tape, run it on the simulated machine, write a report (TAPE=, OPTIONS=)
	@.venv/bin/gapkeeper run $(TAPE) $(OPTIONS)

check: venv    ## lint, types and every quick test: the loop while you work
	@$(MAKE) --no-print-directory lint
	@$(PY) -m pytest -q -n $(WORKERS) --dist worksteal -m quick --sim amaranth $(or $(TESTS),testbench/unit)

# A test checks the types: so both cores are at work meanwhile.
test: install  ## every test but the long ones (soak); decides whether a change lands (TESTS=)
	@$(PY) -m ruff check
	@$(PY) -m pytest -n $(WORKERS) --dist worksteal $(TESTS)

lint: venv     ## unused names, order of imports, docstrings; types of the host
	@$(PY) -m ruff check
	@$(PY) -m mypy

docs: venv     ## these pages as a site in build/docs; warnings are errors
	@$(PY) -m sphinx -W --keep-going -q -b html docs build/docs
	@echo "build/docs/index.html"

bench: install ## every figure of docs/results/figures.md; minutes (BESIDE=)
	@$(if $(BESIDE),$(PY) -m testbench.beside $(BESIDE),.venv/bin/gapkeeper bench)

boards: venv   ## lay out every board, two at a time, and judge its cells and clock (BOARDS=)
	@.venv/bin/gapkeeper build $(BOARDS)
	@$(PY) -m testbench.budget.boards $(BOARDS)

soak: install  ## runs of minutes to hours (TESTS=)
	@$(PY) -m pytest -m "soak or counted" --all-cases $(TESTS)

faults: install ## faults injected into the simulated machine; table and report, minutes (FAULTS=)
	@$(PY) -m testbench.faults $(FAULTS)

install: venv
	@$(PY) -m host.prepare

venv:
	@$(PYTHON) host/bootstrap.py

clean:         ## remove everything that was made
	rm -rf build .venv *.egg-info
