"""The Python examples of the READMEs and of the book run exactly as they are written."""

import re

import pytest
from conftest import SOURCE

PAGES = ["README.md", "sims/python/README.md", "framework/book/src/python.md", "framework/book/src/theory.md", "framework/book/src/how_connect.md"]


def test_every_page_with_examples_is_run():
    with_examples = {p for p in (SOURCE / "framework/book/src").glob("*.md") if "```python\n" in p.read_text()}
    assert with_examples == {SOURCE / p for p in PAGES if "/book/" in p}


@pytest.mark.parametrize("page", PAGES)
def test_examples_run_as_written(page, tmp_path, monkeypatch, capsys):
    text = (SOURCE / page).read_text()
    blocks = re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S)
    assert blocks, f"{page} has no examples"
    # This is the folder in which the examples find their files and may write.
    for name in ("sims", "assemblies"):
        (tmp_path / name).symlink_to(SOURCE / name)
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "example"}
    for k, block in enumerate(blocks):
        exec(compile(block, f"{page}, example {k + 1}", "exec"), names)
    assert capsys.readouterr().out
