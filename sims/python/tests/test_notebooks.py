"""The notebooks run from top to bottom, do what they assert, and are stored without outputs."""

import json

import nbformat
import pytest
from conftest import SOURCE
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

FOLDER = SOURCE / "sims/python/notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def run(notebook, folder):
    """Execute a notebook in a kernel of this interpreter, in a folder. Raises with the cell and its error."""
    NotebookClient(notebook, timeout=120, kernel_name="python3", resources={"metadata": {"path": str(folder)}}).execute()


def faults(path):
    """Return the faults of a stored notebook."""
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    found = []
    if not notebook.cells or notebook.cells[0].cell_type != "markdown":
        found.append("does not begin with words")
    if any(cell.outputs or cell.execution_count is not None for cell in code):
        found.append("has outputs: clear them before it is stored")
    if sum("assert " in cell.source for cell in code) < 3:
        found.append("asserts next to nothing of what it says")
    if not any(cell.source.lstrip().startswith("#") for cell in notebook.cells):
        found.append("has no title")
    return found


def test_all_notebooks_are_listed_for_their_readers():
    page = (FOLDER / "README.md").read_text()
    assert NOTEBOOKS and all(f"`{path.name}`" in page for path in NOTEBOOKS)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_what_it_says_holds(path):
    assert not faults(path), f"{path.name} {faults(path)}"
    notebook = nbformat.read(path, as_version=4)
    run(notebook, FOLDER)
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert not any(output.get("name") == "stderr" for output in outputs), [o["text"] for o in outputs if o.get("name") == "stderr"]
    assert any("image/png" in output.get("data", {}) for output in outputs), "no picture"


def test_a_notebook_that_fails_is_seen(tmp_path):
    path = tmp_path / "bad.ipynb"
    cell = nbformat.v4.new_code_cell("assert 1 + 1 == 3, 'three'")
    notebook = nbformat.v4.new_notebook(cells=[cell])
    with pytest.raises(CellExecutionError, match="three"):
        run(notebook, tmp_path)
    nbformat.write(notebook, path)
    assert len(faults(path)) == 4
    assert json.loads(path.read_text())["cells"][0]["outputs"]
