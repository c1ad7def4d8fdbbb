"""A program as `rcgen` makes it: `program.py MODULE:CLASS FOLDER ARGUMENTS`. The environment variable
PROGRAM has more of its description, as JSON."""

import json
import os
import sys
from pathlib import Path

import robocomp
from build import Fixture
from demo import MODULE

FIXTURE = (
    Fixture(
        "program",
        [MODULE],
        "local",
        parameters={
            "name": "program",
            "parameters": [
                {
                    "name": "speed",
                    "kind": {"scalar": {"type": "float"}},
                    "default": {"float": 400.0},
                    "range": {"min": {"float": 0.0}, "max": {"float": 1500.0}},
                    "editable": True,
                },
                {
                    "name": "password",
                    "kind": {"scalar": {"type": "string"}},
                    "default": {"text": "unset"},
                    "editable": True,
                    "secret": True,
                },
                {
                    "name": "pause",
                    "kind": {"scalar": {"type": "duration"}},
                    "default": {"duration": 250000000},
                },
            ],
        },
    )
    .slot("Echo", "requires", "Demo::Echo")
    .slot("Reports", "subscribesTo", "Demo::Reports")
    .slot("Served", "implements", "Demo::Notes")
)
FIXTURE.description.update(json.loads(os.environ.get("PROGRAM", "{}")))
Worker = FIXTURE.worker

if __name__ == "__main__":
    # A worker imports its generated package under its own name.
    sys.modules["program"] = sys.modules["__main__"]
    folder = Path(sys.argv[2])
    sys.path.insert(0, str(folder))

    class SpecificWorker(Worker):
        pass

    component = FIXTURE.component(SpecificWorker, str(folder))
    sys.exit(robocomp.main(component, sys.argv[1], sys.argv[3:]))
