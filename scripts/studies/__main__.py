"""Studies: they measure, and write the pages of docs/results/.

    python scripts/studies                   # lists them
    python scripts/studies NAME [options]    # runs one; `--help` lists its options

Modules that help several studies stand beside them and are not listed.
"""

from __future__ import annotations

import ast
import importlib
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

FOLDER = Path(__file__).resolve().parent


def study_paths() -> dict[str, Path]:
    """Return the file of each study by its name, folder by folder; no study is imported."""
    paths = sorted(FOLDER.glob("*/*.py"))
    return {path.stem: path for path in paths if _entry(path.stem, _parsed(path))}


def _parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def _entry(name: str, module: ast.Module) -> str:
    """Return the function that runs a study; "" for a module that only helps others.

    It is `main`, or one of the module's own name that returns a `StudyReport`.
    """
    functions = [node for node in module.body if isinstance(node, ast.FunctionDef)]
    reports = {node.name for node in functions if _returns(node) == "StudyReport"}
    if any(node.name == "main" for node in functions):
        return "main"
    return name if name in reports else ""


def _returns(function: ast.FunctionDef) -> str:
    return ast.unparse(function.returns) if function.returns else ""


def listing() -> Iterator[str]:
    """Yield a line for each study, below the line of its folder."""
    paths = study_paths()
    width = max(map(len, paths))
    for folder in sorted({path.parent for path in paths.values()}):
        yield f"{folder.name}: {_first_line(folder / '__init__.py')}"
        for name, path in paths.items():
            if path.parent == folder:
                yield f"  {name:{width}}  {_first_line(path)}"


def _first_line(path: Path) -> str:
    return (ast.get_docstring(_parsed(path)) or "").partition("\n")[0]


def main(argv: Sequence[str] | None = None) -> int:
    """List the studies, or run one. Return the exit status."""
    words = list(sys.argv[1:] if argv is None else argv)
    if not words or words[0] in ("-h", "--help"):
        print(__doc__, *listing(), sep="\n")
        return 0
    name, *options = words
    path = study_paths().get(name)
    if path is None:
        print(f"no study {name!r}; `python scripts/studies` lists them", file=sys.stderr)
        return 2
    module = importlib.import_module(f"studies.{path.parent.name}.{name}")
    function = getattr(module, _entry(name, _parsed(path)))
    if function.__name__ == "main":
        return int(function(options))
    from studies.study import run_study

    return run_study(function, options)


if __name__ == "__main__":
    # In place of this folder, whose modules are imported as `studies.FOLDER.NAME`.
    sys.path[:1] = [str(FOLDER.parent), str(FOLDER.parents[1] / "tests")]
    sys.argv[0] = " ".join(["scripts/studies", *sys.argv[1:2]])  # what `--help` shows
    sys.exit(main())
