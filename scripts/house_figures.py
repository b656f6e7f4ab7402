"""Figures of the package's shape: files, lines, imports, circles, public names.

    python scripts/house_figures.py                  # a Markdown table on stdout
    python scripts/house_figures.py --list circles   # what stands behind a figure

Imports are read from the syntax trees: those inside of functions, those for type checkers only and
those by a string (`import_module("hexapod_pin...")`, tables of names included) count as well. A
circle is a set of modules that import each other, directly or through others. Code lines are lines
without blank ones, comments and docstrings.
"""

from __future__ import annotations

import argparse
import ast
import io
import sys
import tokenize
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "hexapod_pin"
LONGEST = 450
"""Lines of a file that is not long."""


@dataclass
class Module:
    """A module of the package.

    Attributes:
        name: with dots.
        lines: all of them.
        code: without blank lines, comments and docstrings.
        import_lines: of code.
        imports: modules of the package, by how: "run", "types" or "text".
    """

    name: str
    lines: int = 0
    code: int = 0
    import_lines: int = 0
    imports: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))

    @property
    def all_imports(self) -> set[str]:
        """Modules that it imports in any way."""
        return set().union(*self.imports.values()) - {self.name}


def read_package(root: Path = ROOT) -> dict[str, Module]:
    """Return the package's modules by their names."""
    paths = {_name(path, root): path for path in sorted((root / PACKAGE).rglob("*.py"))}
    return {name: _read(name, path, set(paths)) for name, path in paths.items()}


def _name(path: Path, root: Path) -> str:
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _read(name: str, path: Path, known: set[str]) -> Module:
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    found = Module(name, lines=text.count("\n"), code=len(_code_lines(text, tree)))
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    checked_only = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)
        and not isinstance(node.test, ast.UnaryOp)
        for part in node.body for inner in ast.walk(part)
    }  # fmt: skip
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            found.import_lines += (node.end_lineno or node.lineno) - node.lineno + 1
            how = "types" if id(node) in checked_only else "run"
            found.imports[how] |= set(_targets(node, package, known))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found.imports["text"] |= _named(name, node.value) & known
    return found


def _named(module: str, text: str) -> set[str]:
    """Return the modules that a string may name: with or without the package in front.

    The package itself is left out: its table of public names says where each is imported from.
    """
    if module == PACKAGE or "." not in text.strip("."):
        return set()
    return {text, f"{PACKAGE}.{text.lstrip('.')}"}


def _code_lines(text: str, tree: ast.AST) -> set[int]:
    """Return the numbers of lines that are neither blank, comment nor docstring."""
    skipped = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}
    found = set[int]()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in skipped and token.type != tokenize.ENDMARKER:
            found |= set(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            if isinstance(node.value.value, str):
                found -= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return found


def _targets(node: ast.Import | ast.ImportFrom, package: str, known: set[str]) -> Iterator[str]:
    """Yield the modules of the package that an import names."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if alias.name in known)
        return
    base = node.module or ""
    if node.level:
        parents = package.split(".")
        base = ".".join([*parents[: len(parents) - node.level + 1], *filter(None, [base])])
    for alias in node.names:
        inner = f"{base}.{alias.name}"
        if inner in known:
            yield inner
        elif base in known:
            yield base


def circles(graph: Mapping[str, set[str]]) -> list[list[str]]:
    """Return the strongly connected sets of more than one module (Tarjan, without recursion)."""
    index, low, on, stack = dict[str, int](), dict[str, int](), set[str](), list[str]()
    found = list[list[str]]()
    for root in graph:
        if root in index:
            continue
        work = [(root, iter(sorted(graph[root])))]
        index[root] = low[root] = len(index)
        stack.append(root)
        on.add(root)
        while work:
            node, following = work[-1]
            for one in following:
                if one not in graph:
                    continue
                if one not in index:
                    index[one] = low[one] = len(index)
                    stack.append(one)
                    on.add(one)
                    work.append((one, iter(sorted(graph[one]))))
                    break
                if one in on:
                    low[node] = min(low[node], index[one])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    own = stack[stack.index(node) :]
                    del stack[stack.index(node) :]
                    on -= set(own)
                    if len(own) > 1:
                        found.append(sorted(own))
    return found


def _graph(modules: Mapping[str, Module], *hows: str) -> dict[str, set[str]]:
    """Return what each module imports; rooms (`__init__`) hand on what they are made of."""
    return {
        name: set().union(*(module.imports[how] for how in hows)) - {name}
        for name, module in modules.items()
    }


def figures(root: Path = ROOT) -> dict[str, tuple[object, list[str]]]:
    """Return each figure with what stands behind it."""
    modules = read_package(root)
    own = {name: one for name, one in modules.items() if not _is_native(name)}
    importers = defaultdict[str, set[str]](set)
    for name, module in modules.items():
        for target in module.all_imports:
            importers[target].add(name)
    rooms = {name for name in modules if any(other.startswith(f"{name}.") for other in modules)}
    single = sorted(n for n, who in importers.items() if len(who) == 1 and n not in rooms)
    lines, code = (sum(getattr(one, what) for one in own.values()) for what in ("lines", "code"))
    imports = sum(one.import_lines for one in own.values())
    told = sorted(f"{n} -> {t}" for n, m in modules.items() for t in m.imports["text"] if t != n)
    run, every = circles(_graph(modules, "run")), circles(_graph(modules, "run", "types", "text"))
    long = sorted(f"{n}: {m.lines}" for n, m in modules.items() if m.lines > LONGEST)
    meta = _uses(root, ".meta")
    native = [path for path in (root / PACKAGE / "native").rglob("*.?pp")]
    tests = sorted((root / "tests").rglob("*.py"))
    return {
        "Python files": (len(own), sorted(own)),
        "lines": (lines, [f"{n}: {m.lines}" for n, m in own.items()]),
        "code lines": (code, []),
        "lines of imports": (f"{imports} ({imports / max(lines, 1):.1%})", []),
        "modules with one importer": (len(single), single),
        "circles at run time": (len(run), [" ".join(one) for one in run]),
        "circles": (len(every), [" ".join(one) for one in every]),
        "imports by a string": (len(told), told),
        f"files over {LONGEST} lines": (len(long), long),
        "uses of .meta": (len(meta), meta),
        "public names": (len(_public(root)), _public(root)),
        "lines of C++": (sum(path.read_text().count("\n") for path in native), []),
        "lines of tests": (sum(path.read_text().count("\n") for path in tests), []),
    }


def _is_native(name: str) -> bool:
    return name.startswith(f"{PACKAGE}.native")


def _uses(root: Path, word: str) -> list[str]:
    """Return the places where an attribute is read."""
    name, found = word.lstrip("."), []
    for path in sorted((root / PACKAGE).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Attribute) and node.attr == name:
                found.append(f"{path.relative_to(root)}:{node.lineno}")
    return found


def _public(root: Path) -> list[str]:
    """Return the public names of the package: those of its stub."""
    tree = ast.parse((root / PACKAGE / "__init__.pyi").read_text(encoding="utf-8"))
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    return sorted(alias.asname or alias.name for node in imports for alias in node.names)


def main(argv: list[str] | None = None) -> int:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=Path, default=ROOT, help="of another checkout")
    parser.add_argument("--list", metavar="FIGURE", help="print what stands behind a figure")
    given = parser.parse_args(argv)
    found = figures(given.root.resolve())
    if given.list:
        print("\n".join(found[given.list][1]))
        return 0
    print("| figure | number |\n| --- | --- |")
    for name, (number, _) in found.items():
        print(f"| {name} | {number} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
