# Two commands for a fresh clone: `make demo` shows the agent at work, `make test` tries every part of it.
# Both install what is missing on their first run, and nothing on their second.

SHELL := /bin/bash
VENV := .venv
INSTRUCTION := put the cups in a small circle on the left
# A scene with four cups; other seeds have up to seven.
SEED := 2
LOCKS := $(wildcard scripts/locks/*.txt)
UV := build/uv
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: demo test lock oldest clean

demo: $(VENV)/.installed
	$(VENV)/bin/structagent run "$(INSTRUCTION)" --seed $(SEED) --out out/demo

# One test process more than there are cores, of one thread each, because tests also wait. The tests start many commands:
# compiled modules are kept.
# With FAST=1 only what took less than a tenth of a second the last time.
test: $(VENV)/.installed-for-tests
	PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 $(VENV)/bin/python -m pytest --numprocesses $$(($$(getconf _NPROCESSORS_ONLN) + 1)) --dist worksteal

# The clone itself is installed (editable), so only a change of the dependencies installs anew.
$(VENV)/.installed: pyproject.toml scripts/prepare.sh scripts/install.sh $(LOCKS)
	bash scripts/prepare.sh $(VENV)
	bash scripts/install.sh $(VENV)
	touch $@

$(VENV)/.installed-for-tests: pyproject.toml scripts/prepare.sh scripts/install.sh $(LOCKS)
	bash scripts/prepare.sh $(VENV) test
	bash scripts/install.sh $(VENV) test
	touch $@ $(VENV)/.installed

# For developers: writes scripts/locks/ after a change of the dependencies; `make lock UPGRADE=1` takes newer versions.
lock: $(UV)/.installed
	$(UV)/bin/python scripts/lock.py $(if $(UPGRADE),--upgrade)

# For developers: tries the wheel with the oldest version of each dependency that pyproject.toml allows.
oldest: $(UV)/.installed
	bash scripts/oldest.sh $(UV)/bin/uv

$(UV)/.installed: scripts/locks/uv.txt
	bash scripts/prepare.sh $(UV)
	$(UV)/bin/python -m pip install --quiet --require-hashes --requirement scripts/locks/uv.txt
	touch $@

clean:
	rm -rf $(VENV) build dist *.egg-info
