"""The notebook of the workflows holds no outputs and runs from its first cell to its
last.
"""

import json
import re
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).parents[1] / "workflows" / "rig_vs_field.ipynb"


def test_the_notebook_holds_no_outputs():
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    assert [cell["outputs"] for cell in cells if cell.get("outputs")] == []
    assert {cell.get("execution_count") for cell in cells} == {None}


@pytest.mark.slow
def test_the_notebook_runs_and_draws(tmp_path):
    """In a kernel of its own: three figures, and more km in the field than on the rig
    for one depth.
    """
    import nbclient
    import nbformat

    notebook = nbformat.read(NOTEBOOK, as_version=4)
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources=resources
    ).execute()
    outputs = [one for cell in notebook.cells for one in cell.get("outputs", [])]
    assert sum("image/png" in one.get("data", {}) for one in outputs) == 3
    rig, field = re.findall(r"(\d+) km", outputs[-1]["data"]["text/plain"])
    assert 0.0 < float(rig) < float(field)
    assert (tmp_path / "out" / "notebook" / "translation.nc").is_file()
