# make demo: an environment, then nrdf at work on bundled shapes, in demo/
# make studio: an environment, then the studio in a browser; its session is kept in studio/
# make test: an environment with the tools, then ruff, mypy and all tests
# make studio-tour: a path through the studio in a real browser, timed; pictures and a film
# make docs: the documentation as a site, in build/site/
# make wheel: the package as a file, in build/dist/; checked in an environment of its own
# make fuzz: damaged files of every kind until stopped, or for as long as: make fuzz MINUTES=10
# Another interpreter: make PYTHON=/path/to/python3.12 test

VENV := .venv
BIN := $(VENV)/bin
CANDIDATES := python3 python3.11 python3.12 python3.10 python3.13
SUITABLE := -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 10))'
PYTHON ?= $(shell for name in $(CANDIDATES); do \
	$$name $(SUITABLE) 2>/dev/null && { echo $$name; break; }; done)

.PHONY: demo studio studio-tour test docs wheel fuzz format clean
.DELETE_ON_ERROR:

demo: $(VENV)/nrdf.stamp
	$(BIN)/nrdf demo --out demo --overwrite

studio: $(VENV)/studio.stamp
	$(BIN)/nrdf studio

test: $(VENV)/dev.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/pytest --numprocesses auto --dist loadfile --no-loadscope-reorder

studio-tour: $(VENV)/dev.stamp
	$(BIN)/python tools/studio_tour.py

docs: $(VENV)/dev.stamp
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build

wheel: $(VENV)/dev.stamp
	$(BIN)/python tools/check_wheel.py --keep build/dist

fuzz: $(VENV)/dev.stamp
	$(BIN)/python tools/fuzz.py $(MINUTES)

format: $(VENV)/dev.stamp
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "no python3 of version 3.10 or newer with venv found;" \
		"install one, or name it: make PYTHON=/path/to/python3" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/nrdf.stamp: pyproject.toml constraints.txt | $(BIN)/python
	$(BIN)/python -m pip install --quiet -c constraints.txt -e ".[robot]"
	@touch $@

$(VENV)/studio.stamp: pyproject.toml constraints.txt | $(BIN)/python
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[studio,robot]'
	@touch $@ $(VENV)/nrdf.stamp

$(VENV)/dev.stamp: pyproject.toml constraints.txt | $(BIN)/python
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[dev]'
	@touch $@ $(VENV)/nrdf.stamp $(VENV)/studio.stamp

clean:
	rm -rf $(VENV) build demo
