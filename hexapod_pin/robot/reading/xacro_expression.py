"""Values of a xacro file's expressions, found by walking their syntax tree: nothing is run.

Arithmetic, comparisons, texts, lists, mappings and calls of the functions that xacro offers. What
could take long or grow without end is refused before it is done.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping, Sized
from typing import Any

MAX_SIZE = 100_000
"""Most characters or members of a value."""
MAX_BITS = 4096
"""Of a whole number."""
MAX_NODES = 200_000
"""Most parts of an expression that are evaluated, repeated ones counted again."""

_METHODS = {
    "lower", "upper", "strip", "lstrip", "rstrip", "split", "startswith", "endswith", "title",
    "capitalize", "isdigit", "keys", "values", "items", "get", "index", "count", "find", "replace",
    "join",
}  # fmt: skip
_REFUSED = {"factorial", "comb", "perm", "prod", "vars", "type", "hash", "complex", "filter"}
_WIDTH = re.compile(r"%[^%a-zA-Z]*(\d{4}|\*)")
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv, ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod,
    ast.Pow: operator.pow, ast.LShift: operator.lshift, ast.RShift: operator.rshift,
    ast.BitAnd: operator.and_, ast.BitOr: operator.or_, ast.BitXor: operator.xor,
}  # fmt: skip
_UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.UAdd: operator.pos, ast.USub: operator.neg, ast.Not: operator.not_,
    ast.Invert: operator.invert,
}  # fmt: skip
_COMPARE: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le,
    ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Is: operator.is_, ast.IsNot: operator.is_not,
    ast.In: lambda a, b: a in b, ast.NotIn: lambda a, b: a not in b,
}  # fmt: skip


def value_of(expression: str, *names: Mapping[str, Any] | None) -> Any:
    """Return the value of a Python expression.

    Args:
        expression: its text.
        names: what its names stand for; the first that knows a name counts.

    Raises:
        SyntaxError: it is no expression.
        NameError: a name stands for nothing.
        ValueError: it has a part that is not allowed, or that would grow beyond the limits above.
    """
    tree = ast.parse(expression.strip(), "<expression>", "eval")
    walk = _Walk([scope for scope in names if scope is not None])
    return _of_a_depth(walk.value(tree.body))


class _Walk:
    """One evaluation."""

    def __init__(self, scopes: list[Mapping[str, Any]]) -> None:
        self._scopes, self._nodes = scopes, 0

    def value(self, node: ast.expr) -> Any:
        self._nodes += 1
        if self._nodes > MAX_NODES:
            raise ValueError(f"an expression of more than {MAX_NODES} parts")
        find = getattr(self, f"_{type(node).__name__.lower()}", None)
        if find is None:
            raise ValueError(f"{type(node).__name__} is not allowed in an expression")
        return _of_a_size(find(node))

    def _constant(self, node: ast.Constant) -> Any:
        return node.value

    def _name(self, node: ast.Name) -> Any:
        _require_plain(node.id)
        for scope in self._scopes:
            try:
                return scope[node.id]
            except KeyError:
                continue
        raise NameError(f"name '{node.id}' is not defined")

    def _attribute(self, node: ast.Attribute) -> Any:
        _require_plain(node.attr)
        owner = self.value(node.value)
        if isinstance(owner, dict) and node.attr in owner:
            return owner[node.attr]
        if node.attr in _METHODS and isinstance(owner, str | dict | list | tuple):
            return getattr(owner, node.attr)
        raise ValueError(f"there is no {node.attr!r} that an expression may use")

    def _subscript(self, node: ast.Subscript) -> Any:
        return self.value(node.value)[self.value(node.slice)]

    def _slice(self, node: ast.Slice) -> slice:
        parts = (node.lower, node.upper, node.step)
        return slice(*(None if part is None else self.value(part) for part in parts))

    def _binop(self, node: ast.BinOp) -> Any:
        left, right = self.value(node.left), self.value(node.right)
        _refuse_growth(node.op, left, right)
        return _BINARY[type(node.op)](left, right)

    def _unaryop(self, node: ast.UnaryOp) -> Any:
        return _UNARY[type(node.op)](self.value(node.operand))

    def _boolop(self, node: ast.BoolOp) -> Any:
        ends = isinstance(node.op, ast.Or)
        for part in node.values:
            if bool(found := self.value(part)) is ends:
                break
        return found

    def _compare(self, node: ast.Compare) -> Any:
        left = self.value(node.left)
        for sign, part in zip(node.ops, node.comparators, strict=True):
            right = self.value(part)
            if not (found := _COMPARE[type(sign)](left, right)):
                return found
            left = right
        return found

    def _ifexp(self, node: ast.IfExp) -> Any:
        return self.value(node.body if self.value(node.test) else node.orelse)

    def _list(self, node: ast.List) -> list[Any]:
        return [self.value(part) for part in node.elts]

    def _tuple(self, node: ast.Tuple) -> tuple[Any, ...]:
        return tuple(self.value(part) for part in node.elts)

    def _dict(self, node: ast.Dict) -> dict[Any, Any]:
        if any(key is None for key in node.keys):
            raise ValueError("** is not allowed in an expression")
        pairs = zip(node.keys, node.values, strict=True)
        return {self.value(key): self.value(value) for key, value in pairs if key is not None}

    def _listcomp(self, node: ast.ListComp) -> list[Any]:
        if len(node.generators) != 1 or not isinstance(node.generators[0].target, ast.Name):
            raise ValueError("a list made of a list takes one name and one 'for'")
        loop, made = node.generators[0], []
        scopes = self._scopes
        for one in self.value(loop.iter):
            self._scopes = [{loop.target.id: one}, *scopes]  # type: ignore[attr-defined]
            if all(self.value(test) for test in loop.ifs):
                made.append(self.value(node.elt))
        self._scopes = scopes
        return made

    _generatorexp = _listcomp

    def _call(self, node: ast.Call) -> Any:
        call, given = self.value(node.func), [_of_a_depth(self.value(part)) for part in node.args]
        keywords = {word.arg: self.value(word.value) for word in node.keywords if word.arg}
        if not callable(call):
            raise ValueError(f"{call!r} cannot be called")
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        if name == "range":
            return _of_a_size(range(*given))
        if name in ("replace", "join"):
            _refuse_long(getattr(call, "__self__", ""), given)
        return call(*given, **keywords)


def _require_plain(name: str) -> None:
    if name.startswith("_") or name in _REFUSED:
        raise ValueError(f"the name {name!r} is not allowed in an expression")


def _of_a_size(value: Any) -> Any:
    """Return a value that is not too large."""
    if isinstance(value, int) and value.bit_length() > MAX_BITS:
        raise ValueError(f"a number of more than {MAX_BITS} bits")
    if isinstance(value, str | list | tuple | range | dict | set) and len(value) > MAX_SIZE:
        raise ValueError(f"a value of more than {MAX_SIZE} characters or members")
    return value


def _of_a_depth(value: Any) -> Any:
    """Return a value that is not too large with all that its members hold."""
    seen, waiting = 0, [value]
    while waiting:
        one = waiting.pop()
        seen += 1
        if isinstance(one, dict | list | tuple | set):
            waiting.extend(dict.values(one) if isinstance(one, dict) else one)
        if seen + len(waiting) > MAX_SIZE:
            raise ValueError(f"a value of more than {MAX_SIZE} characters or members")
    return value


def _refuse_growth(sign: ast.operator, left: Any, right: Any) -> None:
    """Refuse an operation whose result would be too large, before it is done."""
    if isinstance(sign, ast.Mult):
        for one, other in ((left, right), (right, left)):
            if isinstance(one, Sized) and isinstance(other, int) and len(one) * other > MAX_SIZE:
                raise ValueError(f"a value of more than {MAX_SIZE} characters or members")
    elif (
        isinstance(sign, ast.Pow | ast.LShift) and isinstance(left, int) and isinstance(right, int)
    ):
        factor = left.bit_length() if isinstance(sign, ast.Pow) else 1
        if factor * right > MAX_BITS:
            raise ValueError(f"a number of more than {MAX_BITS} bits")
    elif isinstance(sign, ast.Mod) and isinstance(left, str) and _WIDTH.search(left):
        raise ValueError("a width of more than three digits")


def _whole(*values: Any) -> bool:
    return all(isinstance(value, int) for value in values)


def _refuse_long(text: Any, given: list[Any]) -> None:
    """Refuse texts that would be put together to one that is too long."""
    sizes = [len(one) for one in (text, *given) if isinstance(one, Sized)]
    longest = max((len(one) for many in given if isinstance(many, list | tuple)
                   for one in many if isinstance(one, str)), default=1)  # fmt: skip
    product = max(longest, 1) if sizes else 1
    for size in sizes:
        product *= max(size, 1)
    if product > 100 * MAX_SIZE:
        raise ValueError(f"a value of more than {MAX_SIZE} characters or members")
