"""The example notebook runs, and its cells show what they say: drawing, table, plot, animation."""

import os
import warnings
from html import unescape
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).parents[2] / "examples" / "notebook.ipynb"


@pytest.fixture(scope="module")
def shown():
    """By the last line of a code cell what it shows, by media type, after a run of all in a kernel of their own."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the notebook's own machinery
        import nbformat
        from nbclient import NotebookClient

        book = nbformat.read(NOTEBOOK, as_version=4)
        own = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}  # that of notebooks
        client = NotebookClient(book, timeout=300, resources={"metadata": {"path": str(NOTEBOOK.parent)}})
        client.execute(env=own)
    found = {}
    for cell in (cell for cell in book.cells if cell.cell_type == "code"):
        assert {output.output_type for output in cell.outputs} <= {"execute_result", "display_data"}, cell
        found[cell.source.splitlines()[-1]] = {
            kind: data for output in cell.outputs for kind, data in output.data.items()
        }
    return found


def test_it_is_kept_without_outputs():
    text = NOTEBOOK.read_text("utf-8")
    assert '"outputs": []' in text
    assert "image/png" not in text


@pytest.mark.slow
def test_every_cell_shows_what_it_says(shown):
    mechanism = shown["mechanism"]["text/html"]
    assert "<svg" in mechanism
    assert "I(0,1)R → II(2,3)RRR" in mechanism
    assert "image/png" in shown["mechanism.plot()"]
    assert "drive torque of A" in shown["result.trunnion"]["text/html"]
    (table,) = (data for line, data in shown.items() if line.endswith(".head()"))
    assert table["text/html"].count("<tr") == 6
    assert "image/png" in shown['result["drive_effort"].plot();']
    assert "image/png" in shown['result.trunnion.plot("reactions")']
    moving = shown["result.trunnion.animate()"]["text/html"]
    assert moving.startswith("<iframe")
    assert '<div id="stage"' in unescape(moving)
