"""Fixtures: the repository's recordings, and the command line that every number is compared with."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
RECORDINGS = REPOSITORY / "fixtures/recordings/v1"


@pytest.fixture
def good() -> Path:
    return RECORDINGS / "good"


@pytest.fixture
def pictures(good: Path) -> list[Path]:
    return sorted((good / "frames").glob("*.png"))


@pytest.fixture(scope="session")
def program():
    """Runs the command line and returns the JSON on its standard output."""
    named = os.environ.get("BORESIGHT_PROGRAM")
    program = named or shutil.which("boresight")
    if not program:
        pytest.skip("no command line to compare with: set BORESIGHT_PROGRAM")

    def run(*arguments: object) -> dict:
        ended = subprocess.run(
            [program, *map(str, arguments)], capture_output=True, text=True, check=False
        )
        assert ended.returncode in (0, 3, 4), ended.stderr
        return json.loads(ended.stdout)

    return run
