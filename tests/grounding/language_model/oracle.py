"""A language model that knows the labelled goals: a real server on this machine with OpenAI's routes.

It answers as a model would: it sees nothing but the messages, and it names objects by the indices of the message.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from grounding.goal_benchmark.rows import goal_scenes, load_goal_rows
from grounding.goals.goal import Goal
from grounding.language_model.goal_schema import ASK, BUILD, NONE, REFUSE
from grounding.resolve.attributes import SceneObject
from grounding.training.goal_corrections import goal_of
from grounding.training.goal_lines import LabelError
from tests.grounding.dialogue.rates import corrections

DATA = Path(__file__).parents[3] / "grounding" / "benchmark_data"
MODEL = "oracle"
_DECISIONS = {"ok": BUILD, "ask": ASK, "refused": REFUSE}
_ANSWERS = {"nothing": NONE, "impossible": REFUSE, "unclear": ASK}


@dataclass(frozen=True)
class OracleRow:
    """A labelled instruction or correction.

    Attributes:
        text: what is said.
        scene: name of its scene, or `None` if no scene is known.
        before: the goal so far.
        decision: of the reply.
        goal: the right one where the decision is to build.
    """

    text: str
    scene: str | None
    before: Goal
    decision: str
    goal: Goal | None

    @property
    def objects(self) -> tuple[SceneObject, ...] | None:
        return None if self.scene is None else goal_scenes()[self.scene]


def instruction_rows(file: str) -> Iterator[OracleRow]:
    """The rows of a file of `grounding/benchmark_data`."""
    for row in load_goal_rows(DATA / file):
        yield OracleRow(row.text, row.scene, Goal(), _DECISIONS[row.status], row.goals[0] if row.goals else None)


def correction_rows(file: str) -> Iterator[OracleRow]:
    """The rows of a file of corrections, without those whose goal has no label."""
    for row in corrections(file):
        label = row.after.split("||")[0].strip(" .")
        count = len(goal_scenes()[row.scene])
        try:
            goal = None if label in _ANSWERS else goal_of(label, count)
            yield OracleRow(row.text, row.scene, goal_of(row.before, count), _ANSWERS.get(label, BUILD), goal)
        except LabelError:
            continue


class Oracle:
    """What the server knows.

    Attributes:
        answers: (instruction, names of the objects, goal so far) -> row.
        requests: the bodies of all requests, in their order.
        takes_schema: whether a request may have a `response_format`.
    """

    def __init__(self, rows: list[OracleRow], takes_schema: bool = True) -> None:
        self.answers = {(_plain(row.text), _names(row), row.before.to_json()): row for row in rows}
        self.requests: list[dict] = []
        self.takes_schema = takes_schema
        self.url = ""

    def answer(self, body: Mapping, headers: Mapping) -> tuple[int, dict]:
        """The status and the JSON of an answer to a request."""
        self.requests.append(dict(body))
        if "response_format" in body and not self.takes_schema:
            return 400, {"error": {"message": "response_format of type json_schema is not supported"}}
        message = json.loads(body["messages"][-1]["content"])
        there = message["objects"]
        names = None if there is None else tuple(one["name"] for one in there)
        return completion(self.answers[message["instruction"], names, Goal.from_dict(message["goal"]).to_json()])


def completion(row: OracleRow) -> tuple[int, dict]:
    """The status and the JSON of an answer that is labelled."""
    message = {"role": "assistant", "content": reply_of(row)}
    return 200, {"model": MODEL, "choices": [{"message": message, "finish_reason": "stop"}]}


def reply_of(row: OracleRow) -> str:
    """The reply of a model that reads as the row is labelled."""
    return json.dumps(
        {
            "decision": row.decision,
            "goal": None if row.goal is None else row.goal.to_dict(),
            "question": "Which one is meant?" if row.decision == ASK else None,
            "options": [],
            "reason": "This cannot be done." if row.decision == REFUSE else None,
        }
    )


def _plain(text: str) -> str:
    return " ".join(text.split())


def _names(row: OracleRow) -> tuple[str, ...] | None:
    return None if row.objects is None else tuple(one.name for one in row.objects)


@contextmanager
def serving_oracle(oracle: Oracle) -> Iterator[Oracle]:
    """Serve an oracle at `oracle.url` until the block ends."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        wbufsize = -1  # an answer in one piece: between two, the other side waits for 40 ms

        def do_POST(self) -> None:
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            self._send(*oracle.answer(body, self.headers))

        def do_GET(self) -> None:
            self._send(200, {"object": "list", "data": [{"id": MODEL}]})

        def _send(self, status: int, values: dict) -> None:
            body = json.dumps(values).encode()
            self.send_response(status)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    oracle.url = f"http://127.0.0.1:{server.server_address[1]}/v1"
    try:
        yield oracle
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
