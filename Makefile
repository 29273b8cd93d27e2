# Two commands: `make run` and `make test`. Everything goes into .venv; nothing needs root.

VENV := .venv
PIP := $(VENV)/bin/python -m pip --disable-pip-version-check --quiet
SOURCES := treepilot missions behaviours stack tui robots tests

# Python 3.11 if there is one: pybullet has wheels for 3.10 and 3.11 on x86-64 Linux only. For 3.12 and
# 3.13 pip builds it from source, with the NumPy that is installed: without it, pictures are tuples.
PYTHON := $(shell for minor in 11 12 13; do \
	for candidate in python3.$$minor python3 "$$(uv python find 3.$$minor 2>/dev/null)"; do \
	command -v "$$candidate" >/dev/null 2>&1 && "$$candidate" -c "import sys; \
	sys.exit(sys.version_info[:2] != (3, $$minor))" 2>/dev/null && { echo "$$candidate"; exit; }; \
	done; done)
HAS_WHEEL := -c 'import platform, sys; sys.exit( \
	(sys.version_info[:2], sys.platform, platform.machine()) != ((3, 11), "linux", "x86_64"))'
HAS_HEADERS := -c 'import os, sysconfig; \
	os.stat(os.path.join(sysconfig.get_path("include"), "Python.h"))'

.PHONY: run test check wheel-test bench figures figures-timing figures-driving clean help pictures

help:
	@echo "make run              install into .venv and run missions/02_office_patrol.yaml"
	@echo "make test             run the test suite"
	@echo "make check            ruff, formatting, mypy --strict"
	@echo "make wheel-test       build the wheel, install it elsewhere and run all missions with it"
	@echo "make bench            a short run of every benchmark (also written to bench/*.json)"
	@echo "make figures-timing   measure the times in docs/benchmarks.md again (needs a quiet machine)"
	@echo "make figures-driving  measure the driving in docs/benchmarks.md again (BARN=FOLDER: BARN too)"
	@echo "make pictures         draw the pictures of README and docs again (needs Chromium)"
	@echo "make figures          write the tables of docs and README from docs/figures"

$(VENV)/bin/python:
	@if [ -z "$(PYTHON)" ]; then \
		echo "treepilot needs Python 3.11, 3.12 or 3.13; 3.11 is the quickest to install."; \
		echo "One command that provides it:  uv python install 3.11   (or: apt install python3.11-venv)"; \
		exit 2; fi
	@$(PYTHON) $(HAS_WHEEL) || { \
		echo "$$($(PYTHON) --version): pip builds PyBullet from source, about 10 to 20 minutes."; \
		echo "Python 3.11 on x86-64 Linux has a wheel:  uv python install 3.11"; \
		command -v g++ >/dev/null && $(PYTHON) $(HAS_HEADERS) 2>/dev/null || { \
		echo "The build needs g++ and the headers of Python:  apt install g++ python3-dev"; exit 2; }; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: $(VENV)/bin/python pyproject.toml
	@echo "installing treepilot into $(VENV) (once)"
	@$(VENV)/bin/python $(HAS_WHEEL) || { $(PIP) install 'numpy>=2.0' setuptools wheel && \
		$(PIP) install --no-build-isolation 'pybullet>=3.2.6'; }
	$(PIP) install --editable .
	@touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	@echo "installing the test tools into $(VENV) (once)"
	$(PIP) install --editable '.[test]'
	$(PIP) install --no-deps MAVProxy==1.8.75 # its opencv-python would replace opencv-python-headless
	@touch $@

run: $(VENV)/.installed
	@$(VENV)/bin/treepilot run missions/02_office_patrol.yaml

test: $(VENV)/.installed-test
	$(VENV)/bin/python -m pytest -q -n 2 --dist loadgroup

check: $(VENV)/.installed-test
	$(VENV)/bin/ruff check $(SOURCES)
	$(VENV)/bin/ruff format --check $(SOURCES)
	$(VENV)/bin/mypy

wheel-test: $(VENV)/bin/python
	$(VENV)/bin/python -m tests.wheel

bench: $(VENV)/.installed-test
	$(VENV)/bin/python -m tests.benchmarks --trials 2 --worlds 5 --seeds 2 --kidnaps 10 --runs 1 --twists 400 --presses 20

figures: $(VENV)/.installed-test
	$(VENV)/bin/python -m tests.benchmarks.figures

pictures: $(VENV)/.installed-test
	$(VENV)/bin/python -m tests.pictures

figures-timing: $(VENV)/.installed-test
	$(VENV)/bin/python -m tests.benchmarks timing --docs

figures-driving: $(VENV)/.installed-test
	$(VENV)/bin/python -m tests.benchmarks driving --docs $(if $(BARN),--barn $(BARN))

clean:
	rm -rf $(VENV) .mypy_cache .pytest_cache .ruff_cache .hypothesis
