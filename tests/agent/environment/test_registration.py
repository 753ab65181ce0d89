"""What a stranger without the package gymnasium is told."""

import importlib
import sys

import pytest
import structagent


def test_without_gymnasium_the_message_says_what_to_install(monkeypatch):
    for name in ("gymnasium", "gymnasium.envs", "gymnasium.envs.registration"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.delitem(sys.modules, "structagent.gym", raising=False)
    with pytest.raises(structagent.StructagentError, match="needs the package gymnasium: pip install"):
        importlib.import_module("structagent.gym")
