"""What the help of options says is legal."""

from typing import get_args

from agent.cli_options import ObjectsOption
from structdiffusion.objects.libraries import LIBRARIES


def test_every_library_of_objects_is_named():
    option = get_args(ObjectsOption)[1]
    assert sorted(option.metavar.split("|")) == sorted([*LIBRARIES, "DIR"])
