"""The types follow from the Rust sources; the program for mypy also runs correctly, and mypy rejects its wrong lines."""

import re
import subprocess
import sys
from pathlib import Path

from conftest import SOURCE


def test_the_stub_follows_from_the_sources() -> None:
    script = SOURCE / "sims" / "python" / "stubs"
    done = subprocess.run([sys.executable, script, "--check"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


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


def test_the_wrong_lines_are_refused_and_no_others(tmp_path: Path) -> None:
    text = Path(__file__).with_name("typed.py").read_text()
    mark = re.compile(r"  # type: ignore\[([a-z-]+)\]")
    lines = text.splitlines()
    wrong = {(i, m[1]) for i, line in enumerate(lines, 1) if (m := mark.search(line))}
    assert len(wrong) >= 5
    program = tmp_path / "unmarked.py"
    program.write_text("\n".join(mark.sub("", line) for line in lines))
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--show-error-codes", program],
        capture_output=True,
        text=True,
        check=False,
    )
    told = re.findall(r"unmarked\.py:(\d+): error: .*\[([a-z-]+)\]", done.stdout)
    assert {(int(i), code) for i, code in told} == wrong, done.stdout + done.stderr
    assert done.returncode == 1
