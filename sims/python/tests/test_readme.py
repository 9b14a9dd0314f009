"""The Python examples of both READMEs run exactly as they are written."""

import re

import pytest
from conftest import SOURCE

PAGES = ["README.md", "sims/python/README.md"]


@pytest.mark.parametrize("page", PAGES)
def test_examples_run_as_written(page, tmp_path, monkeypatch, capsys):
    text = (SOURCE / page).read_text()
    blocks = re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S)
    assert len(blocks) >= 2, f"{page} has no examples"
    # Where the examples find what they name, and may write.
    for name in ("sims", "assemblies"):
        (tmp_path / name).symlink_to(SOURCE / name)
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "example"}
    for k, block in enumerate(blocks):
        exec(compile(block, f"{page}, example {k + 1}", "exec"), names)
    assert capsys.readouterr().out
