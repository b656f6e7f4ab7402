"""Execute every example and notebook, each in a process of its own, for the pages of the site.

    python scripts/documentation/execute.py build/executed

Each example leaves a folder with its files and `printed.txt`; each notebook is stored with its
outputs. One that fails stops the build with what it printed.
"""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parents[2]
PRINTED = "printed.txt"
TIMEOUT = 600
"""Of one example or one cell [s]."""
QUIET = ["--log-level=ERROR"]
"""Of a kernel, which warns that its messages stay unencrypted within this machine."""


def examples() -> list[Path]:
    """Return the scripts of the gallery."""
    return sorted((ROOT / "examples").glob("*.py"))


def notebooks() -> list[Path]:
    """Return the notebooks, which are stored without outputs."""
    return sorted((ROOT / "notebooks").glob("*.ipynb"))


def run_example(script: Path, folder: Path) -> None:
    """Run an example in an empty folder and store what it prints.

    Raises:
        RuntimeError: it fails or takes longer than `TIMEOUT`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    command = [sys.executable, str(script), "."]
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=TIMEOUT, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{script.name} failed:\n{done.stdout}{done.stderr}")
    (folder / PRINTED).write_text(done.stdout, encoding="utf-8")


def run_notebook(notebook: Path, folder: Path) -> Path:
    """Execute a notebook in an empty folder; return the path of the copy with its outputs.

    Raises:
        nbclient.exceptions.CellExecutionError: a cell raises.
    """
    folder.mkdir(parents=True, exist_ok=True)
    found = nbformat.read(notebook, as_version=4)
    NotebookClient(
        found, extra_arguments=QUIET, timeout=TIMEOUT, kernel_name="python3",
        resources={"metadata": {"path": str(folder)}},
    ).execute()  # fmt: skip
    nbformat.write(found, folder / notebook.name)
    return folder / notebook.name


def main(folder: Path) -> None:
    """Execute everything, two or three at a time."""
    with ThreadPoolExecutor(2) as pool:
        runs = [pool.submit(run_example, path, folder / path.stem) for path in examples()]
        for path in notebooks():  # their client is of one thread
            run_notebook(path, folder / f"notebook_{path.stem}")
        for run in runs:
            run.result()


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
