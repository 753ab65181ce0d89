"""Every known error has an exit code, and only known ones have."""

import importlib

import pytest

from agent import errors


@pytest.mark.parametrize(("module", "name"), list(errors._EXIT_CODE_OF))
def test_every_listed_error_exists_and_is_found(module, name):
    kind = getattr(importlib.import_module(module), name)
    assert errors.exit_code_of(kind("why")) == errors._EXIT_CODE_OF[module, name]


def test_own_errors_carry_their_code():
    assert errors.exit_code_of(errors.NoValidGoal("x")) == 4
    assert errors.exit_code_of(errors.ExecutionFailed("x")) == 5
    assert errors.exit_code_of(KeyboardInterrupt()) == 130


def test_a_defect_has_no_code():
    assert errors.exit_code_of(ZeroDivisionError("x")) is None


def test_messages_are_one_line():
    assert errors.one_sentence(ValueError("a\n  b")) == "a b"


def test_the_operating_system_is_quoted_without_its_number(tmp_path):
    with pytest.raises(OSError) as caught:
        tmp_path.read_text()
    assert errors.one_sentence(caught.value) == f"'{tmp_path}': is a directory"
    assert errors.one_sentence(FileNotFoundError("there are no scenes")) == "there are no scenes"
