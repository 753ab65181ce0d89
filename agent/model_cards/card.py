"""Collect the facts of model cards from the weights, the record of their training and evaluation reports."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from agent.errors import BadInput
from agent.model_cards.catalogue import Network, planners_of
from grounding.packed_weights import CODES, STEP
from grounding.spec import SHAPES
from grounding.untrusted_files import check_weights, read_json, read_regular
from structdiffusion.limits import WEIGHTS_BYTES
from structdiffusion.models import structformer_name

SCHEMA = "structagent-card/1"
RECORD = "training.json"
LARGEST_JSON = 20_000_000  # bytes of a report of an evaluation: one of thousands of scenes has a few million
Facts = dict[str, Any]
_FACTS = ("name", "family", "parameters", "files", "training", "results")
_RECORDED = ("steps", "seconds", "losses", "sessions", "files")
_NOT_OF_TRAINING = ("keywords", "encoder_layer", "difference_to", "weights")  # in a network's config
_SAID_ELSEWHERE = ("schema", "kind", "parameters", "files")  # of a training's record, in the card


def facts_of(network: Network) -> Facts:
    """Return the facts on a network's card or, where it has none, what its files and training record state.

    Raises:
        BadInput: for a card that is not one, or files that cannot be read.
    """
    if network.facts_path.is_file():
        facts = _json(network.facts_path)
        if facts.get("schema") != SCHEMA:
            raise BadInput(f'{network.facts_path} is not a model card: its "schema" must be {SCHEMA!r}')
        return _complete(facts, _FACTS, network.facts_path)
    record = network.folder / RECORD
    training = _complete(_json(record), _RECORDED, record) if record.is_file() else None
    return _facts(network, training, [], training["files"] if training else {})


def new_facts(network: Network, run: Path | None, reports: tuple[Path, ...]) -> Facts:
    """Collect the facts for a new card.

    Args:
        network: the network that the card describes.
        run: the folder of its training, with `training.json`; `None` keeps the recorded facts.
        reports: evaluation reports as `structagent evaluate success`, `discriminators` or `parse` write them; none
            keeps the recorded results.

    Raises:
        BadInput: for a training run of other weights, or a report that does not measure the network.
    """
    known = facts_of(network)
    training, results = known["training"], known["results"]
    if run is not None:
        training = _complete(_json(run / RECORD), _RECORDED, run / RECORD)
        if training["files"] != files_of(network):
            raise BadInput(f"{run / RECORD} is for other weights than those in {network.folder}; copy them there first")
    elif network.family in ("embedding", "goals", "verifier", "llm"):
        training = _parser_training(network)
    if reports:
        results = [_result(network, path) for path in reports]
    return _facts(network, training, results, files_of(network))


def files_of(network: Network) -> dict[str, dict[str, Any]]:
    """Measure each file as it is now: name -> "bytes" and "sha256".

    Raises:
        BadInput: for a missing file.
    """
    found = {}
    for name in network.files:
        path = network.folder / name
        if not path.is_file():
            raise BadInput(f"{network.folder} has no {name}; the network {network.name!r} needs it")
        content = read_regular(path, WEIGHTS_BYTES)
        found[name] = {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    return found


def headline(facts: Mapping[str, Any]) -> str:
    """Summarize the most telling result in a few words; without a measurement, give the final state of the
    training.
    """
    rows = [row for result in facts["results"] for row in result["rows"] if row["of"] in ("all", "free")]
    # Of a network for one structure there are no others.
    rows = rows or [row for result in facts["results"] for row in result["rows"]]
    if rows:
        # Several evaluations of one planner, of other structures or seeds, count together.
        same = [row for row in rows if all(row[key] == rows[0][key] for key in ("by", "of", "what"))]
        n = sum(row["n"] for row in same)
        rate = sum(row["rate"] * row["n"] for row in same) / n
        return f"{100 * rate:.0f} % {rows[0]['what']} ({rows[0]['by']}, n = {n})"
    losses = (facts["training"] or {}).get("losses") or {}
    if "accuracy" in losses:
        return f"{100 * losses['accuracy']:.0f} % right at the end of training"
    return f"loss {losses['loss']:.3f} at the end of training" if "loss" in losses else "not measured"


def _facts(network: Network, training: Facts | None, results: list[Facts], files: Facts) -> Facts:
    if training is not None:
        training = {key: value for key, value in training.items() if key not in _SAID_ELSEWHERE}
    return {
        "schema": SCHEMA,
        "name": network.name,
        "family": network.family,
        "parameters": _parameters(network.folder / network.files[-1]),
        "files": files,
        "training": training,
        "results": results,
    }


def _parameters(path: Path) -> int:
    """Count the parameters in a file of weights; only its header is read."""
    from safetensors import SafetensorError, safe_open

    try:
        check_weights(path, WEIGHTS_BYTES)
        with safe_open(path, "np") as file:
            sizes = {name: math.prod(file.get_slice(name).get_shape()) for name in file.keys()}  # noqa: SIM118
            bits = int((file.metadata() or {}).get("bits", "8"))
    except (SafetensorError, OSError, ValueError) as error:
        raise BadInput(f"{path} cannot be read as weights: {' '.join(str(error).split())}") from error
    stored = {name: size for name, size in sizes.items() if not name.endswith(STEP)}
    return sum(8 * size // bits if name.endswith(CODES) else size for name, size in stored.items())


def _parser_training(network: Network) -> Facts:
    """Read what a parser's trainer wrote beside the weights, or into them."""
    if network.family in ("goals", "verifier"):
        config = _json(network.folder / network.files[0])
        return {name: value for name, value in config.items() if name not in _NOT_OF_TRAINING}
    if network.family == "embedding":
        config = _json(network.folder / network.files[0])
        names = ("encoder_sha256", "seed", "sentences", "before")
        return {name: config[name] for name in names} | {"development": _rate(config["development"]["exact"])}
    from safetensors import safe_open

    with safe_open(network.folder / network.files[-1], "np") as file:
        about = file.metadata() or {}
    return {"language_model": about["model"], **json.loads(about["training"])}


def _result(network: Network, path: Path) -> Facts:
    """Return what a report says about a network."""
    report = _json(path)
    try:
        if network.family == "segmentation":
            rows = _segmentation_rows(report)
        else:
            evaluations = [*report["evaluations"], *report.get("goals", ())]
            of_discriminators = any("discriminator" in evaluation for evaluation in evaluations)
            read = (
                _parsing_rows
                if network.family in ("embedding", "goals", "llm")
                else _accuracy_rows
                if of_discriminators
                else _success_rows
            )
            rows = read(network, evaluations)
        head = {"version": report["version"], "command": report.get("command", "structagent evaluate parse")}
    except (KeyError, TypeError) as error:
        raise BadInput(f"{path} is not a report of an evaluation that measures {network.name!r}") from error
    if not rows:
        raise BadInput(f"{path} does not measure {network.name!r}: none of its planners or parsers is made of it")
    return head | {"rows": rows}


def _success_rows(network: Network, evaluations: list[Facts]) -> list[Facts]:
    using, rows = planners_of(network.name), []
    own = next((shape for shape in SHAPES if structformer_name(shape) == network.name), None)
    for evaluation in evaluations:
        if evaluation["about"]["model"] not in using:
            continue
        for structure, rates in evaluation["aggregate"].items():
            if own is not None and structure != own:  # what the other networks of that planner did
                continue
            rows.append(
                {
                    "by": evaluation["about"]["model"],
                    "of": structure,
                    "what": "stand",
                    "n": rates["n"],
                    **_rate(rates["success"]),
                    "failures": {name: rate["count"] for name, rate in rates["failures"].items() if rate["count"]},
                }
            )
    return rows


def _accuracy_rows(network: Network, evaluations: list[Facts]) -> list[Facts]:
    return [
        {"by": network.name, "of": row["of"], "what": "right", "n": row["n"], **_rate(row)}
        for found in evaluations
        if found["discriminator"] == network.name
        for row in found["rows"]
    ]


def _parsing_rows(network: Network, evaluations: list[Facts]) -> list[Facts]:
    of_goals = network.family == "goals"  # it reads beside the embedding parser
    return [
        {
            "by": found["parser"],
            "of": Path(found["data"]).name,
            "what": "exact",
            "n": found["rows"],
            **_rate(found["exact"]),
        }
        for found in evaluations
        if found["parser"] == ("embedding" if of_goals else network.family) and ("dropped_parts" in found) == of_goals
    ]


def _segmentation_rows(report: Facts) -> list[Facts]:
    return [
        {"by": report["method"], "of": kind, "what": "exact", "n": rates["exact"]["n"], **_rate(rates["exact"])}
        for kind, rates in report["aggregate"].items()
        if report["method"] != "geometry"  # which asks no network
    ]


def _rate(found: Mapping[str, Any]) -> dict[str, float]:
    # Cards show tenths of a percent; rounded to them twice, 0.06049 would be 6.1.
    return {name: round(found[name], 6) for name in ("rate", "low", "high")}


def _complete(content: Facts, keys: Sequence[str], path: Path) -> Facts:
    lacking = [key for key in keys if key not in content]
    if lacking:
        raise BadInput(f"{path} lacks {', '.join(map(repr, lacking))}; it needs {', '.join(map(repr, keys))}")
    return content


def _json(path: Path) -> Facts:
    try:
        content = read_json(path, LARGEST_JSON)
    except ValueError as error:
        raise BadInput(f"{path} is not JSON: {error}") from error
    if not isinstance(content, dict):
        raise BadInput(f"{path} must have a JSON object, and has a {type(content).__name__}")
    return content
