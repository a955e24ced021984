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
BOARDS  ?= ulx3s
# Options for the fault campaign, e.g. make faults FAULTS="--only F3 --seed 2"
FAULTS  ?=

.PHONY: run test install venv bench boards soak faults lint clean

run: install
	@.venv/bin/gapkeeper run $(TAPE) $(OPTIONS)

test: install
	@$(PY) -m ruff check
	@$(PY) -m pytest -n $(JOBS) --dist worksteal $(TESTS)

install: venv
	@$(PY) -m host.prepare

venv:
	@$(PYTHON) host/bootstrap.py

bench: install
	@.venv/bin/gapkeeper bench

boards: venv
	@for board in $(BOARDS); do .venv/bin/gapkeeper build $$board || exit; done

soak: install
	@$(PY) -m pytest -m soak $(TESTS)

faults: install
	@$(PY) -m testbench.faults $(FAULTS)

lint: venv
	@$(PY) -m ruff check

clean:
	rm -rf build .venv *.egg-info
