"""Execute notebooks with this very Python, and turn them into HTML, the same bytes each time."""

import asyncio
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
from jupyter_client.kernelspec import KernelSpec, KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbconvert.exporters import HTMLExporter
from nbformat import NotebookNode
from traitlets.config import Config

from odisar.errors import OdisarError

_AT_A_TIME = 2
_CELL_TIMEOUT_S = 300
#: Cells with this tag are for the reader at the keyboard, not for the report.
_HIDDEN_TAG = "not-in-report"


class _OwnKernel(KernelSpecManager):
    """Knows one kernel: the IPython of the running interpreter.

    A kernel installed by name may belong to another environment.
    """

    def get_kernel_spec(self, kernel_name: str) -> KernelSpec:
        """Return the running interpreter's kernel, whatever the notebook names."""
        command = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
        return KernelSpec(argv=command, display_name=kernel_name, language="python")


def execute_notebooks(root: Path, folder: Path) -> list[Path]:
    """Execute ``notebooks/*.ipynb`` of a workspace into ``folder`` and return the written files.

    Two run at a time, in the workspace's own code. Raises OdisarError with the cell and its error
    where one fails.
    """
    sources = sorted((root / "notebooks").glob("*.ipynb"))
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.ipynb"):
        old.unlink()
    executed = asyncio.run(_execute_all(sources, root))
    written = []
    for source, notebook in zip(sources, executed, strict=True):
        path = folder / source.name
        nbformat.write(notebook, path)  # type: ignore[no-untyped-call]
        written.append(path)
    return written


async def _execute_all(sources: Sequence[Path], root: Path) -> list[NotebookNode]:
    turn = asyncio.Semaphore(_AT_A_TIME)
    return list(await asyncio.gather(*(_execute(source, root, turn) for source in sources)))


async def _execute(source: Path, root: Path, turn: asyncio.Semaphore) -> NotebookNode:
    notebook: NotebookNode = nbformat.read(source, as_version=4)  # type: ignore[no-untyped-call]
    # Sockets in a folder of their own: no port, no writable home, and a path short enough.
    async with turn:
        with TemporaryDirectory() as sockets:
            await _execute_in(notebook, source, root, Path(sockets))
    return notebook


async def _execute_in(notebook: NotebookNode, source: Path, root: Path, sockets: Path) -> None:
    kernel = AsyncKernelManager(
        kernel_spec_manager=_OwnKernel(),
        transport="ipc",
        connection_file=str(sockets / "kernel.json"),
    )
    client = NotebookClient(
        notebook,
        km=kernel,
        timeout=_CELL_TIMEOUT_S,
        record_timing=False,
        resources={"metadata": {"path": str(source.parent)}},
    )
    try:
        await client.async_execute(
            cleanup_kc=True, env=kernel_environment(root), cwd=str(source.parent)
        )
    except CellExecutionError as error:
        raise OdisarError(f"notebook {source.name} failed: {error}") from error


def kernel_environment(root: Path) -> dict[str, str]:
    """Return the environment of a kernel: the workspace's own code first, one thread."""
    inherited = os.environ.get("PYTHONPATH", "")
    path = os.pathsep.join(part for part in (str(root / "src"), inherited) if part)
    one_thread = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    no_debugger = {"PYDEVD_DISABLE_FILE_VALIDATION": "1"}
    return {**os.environ, **one_thread, **no_debugger, "PYTHONPATH": path}


def notebook_title(path: Path) -> str:
    """Return a notebook's first heading, or its file name."""
    notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
    for cell in notebook.cells:
        first = str(cell.source).strip().splitlines()[:1]
        if cell.cell_type == "markdown" and first and first[0].startswith("#"):
            return first[0].lstrip("# ")
    return path.stem


def notebook_html(path: Path) -> str:
    """Return an executed notebook as an HTML fragment: text, code and embedded images."""
    config = Config()
    config.TagRemovePreprocessor.remove_cell_tags = {_HIDDEN_TAG}
    config.TagRemovePreprocessor.enabled = True
    exporter = HTMLExporter(  # type: ignore[no-untyped-call]
        config=config,
        template_name="basic",
        embed_images=True,
        exclude_input_prompt=True,
        exclude_output_prompt=True,
        exclude_anchor_links=True,
        mathjax_url="",
        require_js_url="",
        jquery_url="",
        mermaid_js_url="",
    )
    body, _ = exporter.from_filename(str(path))
    return str(body)
