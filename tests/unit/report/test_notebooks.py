import sys
from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from odisar.errors import OdisarError
from odisar.report.notebooks import execute_notebooks, notebook_html, notebook_title

NOTEBOOKS = sorted((Path(__file__).parents[3] / "notebooks").glob("*.ipynb"))


def write_notebook(root: Path, source: str) -> None:
    (root / "notebooks").mkdir(exist_ok=True)
    cells = [new_markdown_cell("# A title", id="a"), new_code_cell(source, id="b")]
    metadata = {"kernelspec": {"name": "no-such-kernel", "display_name": "x"}}
    nbformat.write(new_notebook(cells=cells, metadata=metadata), root / "notebooks/one.ipynb")


def test_execution_uses_the_running_python_and_the_workspaces_code_and_repeats(tmp_path):
    (tmp_path / "src").mkdir()
    (tmp_path / "src/only_here.py").write_text("VALUE = 41")
    write_notebook(tmp_path, "import sys, only_here\nprint(only_here.VALUE + 1, sys.prefix)")
    first, second = (execute_notebooks(tmp_path, tmp_path / name)[0] for name in ("x", "y"))
    output = nbformat.read(first, as_version=4).cells[1].outputs[0].text
    assert output.split() == ["42", sys.prefix]
    assert first.read_bytes() == second.read_bytes()
    assert notebook_title(first) == "A title"
    assert "http" not in notebook_html(first)


def test_a_failing_cell_is_named(tmp_path):
    write_notebook(tmp_path, "1 / 0")
    with pytest.raises(OdisarError, match=r"one\.ipynb failed.*(?s:.*)ZeroDivisionError"):
        execute_notebooks(tmp_path, tmp_path / "out")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_committed_notebooks_hold_no_outputs(path):
    cells = nbformat.read(path, as_version=4).cells
    code = [cell for cell in cells if cell.cell_type == "code"]
    assert code
    assert not any(cell.outputs or cell.execution_count for cell in code)


def test_the_four_notebooks_are_there():
    assert len(NOTEBOOKS) == 4
