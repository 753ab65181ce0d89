import subprocess
import sys
from pathlib import Path

from tests.commands import ROOT

CODE = """
import sys
from agent.chat.preloading import Preloading

def start(self):
    print("imported:", *({"torch", "trimesh", "scipy.ndimage"} & set(sys.modules)))

Preloading.start = start  # it is called when the table is shown, before the first line is asked for
from agent.cli.app import command_line

command_line(["chat", "--scene", sys.argv[1], "--out", "out"])
"""


def test_what_planning_needs_is_imported_while_the_user_reads_and_types(tmp_path):
    paths = f"import sys; sys.path[:0] = {[str(ROOT), str(ROOT / 'agent' / 'public')]}\n"
    command = [sys.executable, "-c", paths + CODE, str(Path(__file__).with_name("desk.yaml"))]
    process = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, input="")
    assert process.returncode == 0 and "Say what to build" in process.stdout, process.stderr
    assert "imported:\n" in process.stderr  # and nothing after it; a command's own results alone go to its output
