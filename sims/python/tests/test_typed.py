"""The program that mypy reads also does what it says."""

import subprocess
import sys
from pathlib import Path

from conftest import SOURCE


def test_the_typed_program_runs(tmp_path: Path) -> None:
    program = Path(__file__).with_name("typed.py")
    done = subprocess.run(
        [sys.executable, program, tmp_path],
        cwd=SOURCE,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run.mcap").stat().st_size > 0
