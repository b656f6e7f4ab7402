"""The exceptions of this package: one root, each carrying what a caller needs to act on.

A message says what is wrong, where, with which value, what is allowed, and the way out.
"""

from __future__ import annotations

from contextvars import ContextVar
from typing import Any, NamedTuple


class HexapodError(Exception):
    """Root of every exception this package raises on purpose.

    Attributes:
        trace: the samples of the run that the error has ended; None where it ended none, or before
            its first step.
    """

    trace: Any = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy the error as it is, whatever its constructor takes.

        An attribute that cannot be pickled, such as a value that a caller gave, becomes its text:
        the error itself must reach who waits for it in another process.
        """
        kind, args, state = self._parts()
        sent = {name: _portable(value) for name, value in state.items()}
        return _made, (kind, tuple(map(_portable, args))), sent

    def __copy__(self) -> Any:
        """Return another error with the same attributes."""
        kind, args, state = self._parts()
        error = _made(kind, args)
        error.__setstate__(state)
        return error

    def _parts(self) -> tuple[type[HexapodError], tuple[Any, ...], dict[str, Any]]:
        """Return type, arguments and attributes; some of an ImportError are not in `vars`."""
        found: Any = super().__reduce__()
        return found[0], found[1], found[2] if len(found) > 2 else {}


def _made(kind: type[HexapodError], args: tuple[Any, ...]) -> Any:
    """Return an error without a call of its constructor, which composes a message from parts."""
    return kind.__new__(kind, *args)


_trials: ContextVar[int] = ContextVar("trials", default=0)
"""How many `_portable` are at work, one within the other: errors may hold errors, or themselves."""

MOST_TRIALS = 2
"""Errors further inside are taken as they are."""


def _portable(value: Any) -> Any:
    """Return a value if it can be pickled, else its text."""
    if value is None or type(value) in (str, int, float, bool) or _trials.get() == MOST_TRIALS:
        return value
    import pickle

    token = _trials.set(_trials.get() + 1)
    try:
        pickle.dumps(value)
    except Exception:  # whatever the value's own code raises
        return _text_of(value)
    finally:
        _trials.reset(token)
    return value


def _text_of(value: Any) -> str:
    try:
        return repr(value)
    except Exception:
        return object.__repr__(value)


LONGEST_VALUE = 300
"""Of a value in a message; the error itself holds all of it [characters]."""


class ParameterError(HexapodError, ValueError):
    """A parameter is outside its allowed range.

    Attributes:
        name: dotted name of the parameter.
        value: what was given.
        allowed: the allowed range, in words, with its unit.
    """

    def __init__(self, name: str, value: Any, allowed: str, hint: str = "") -> None:
        """Compose the message from its parts; `hint` is the way out."""
        self.name, self.value, self.allowed, self.hint = name, value, allowed, hint
        shown = repr(value)
        if len(shown) > LONGEST_VALUE:
            shown = f"{shown[: LONGEST_VALUE - 4]} ..."
        super().__init__(f"{name} = {shown}: must be {allowed}." + (f" {hint}" if hint else ""))


class ArgumentError(HexapodError, TypeError):
    """A call has an argument that does not exist, or lacks one.

    Attributes:
        call: what was called.
        name: of the argument; empty where the number of arguments is wrong.
    """

    def __init__(self, call: str, name: str, text: str) -> None:
        """Store the parts; `text` is the whole message."""
        self.call, self.name = call, name
        super().__init__(text)


class CatalogFault(NamedTuple):
    """What is wrong in a file of motors.

    Attributes:
        line: in the file, from 1; 0: the file as a whole.
        column: its header; empty: the row as a whole.
        value: what is written there.
        allowed: what must be there, in words, with its unit.
        hint: the way out.
    """

    line: int
    column: str
    value: Any
    allowed: str
    hint: str = ""

    def __str__(self) -> str:
        """Return the fault as one message."""
        where = f"line {self.line}, " if self.line else ""
        what = f"{self.column} = " if self.column else ""
        value = f"{self.value:g}" if isinstance(self.value, float) else repr(self.value)
        return f"{where}{what}{value}: must be {self.allowed}." + f" {self.hint}".rstrip()


class CatalogError(HexapodError, ValueError):
    """A file of motors cannot be used; `faults` lists every bad row, one message each.

    Attributes:
        source: the file.
        faults: what is wrong, in the order of the lines.
    """

    def __init__(self, source: str, faults: list[CatalogFault]) -> None:
        """List all faults at once, so that one edit of the file can mend them all."""
        self.source, self.faults = source, tuple(faults)
        super().__init__("\n".join(f"{source}: {fault}" for fault in faults))

    @property
    def line(self) -> int:
        """Line of the first fault."""
        return self.faults[0].line

    @property
    def column(self) -> str:
        """Column of the first fault."""
        return self.faults[0].column

    @property
    def value(self) -> Any:
        """What is written where the first fault is."""
        return self.faults[0].value


class UrdfError(HexapodError):
    """A URDF cannot be used; `findings` lists every reason, each naming its link or joint."""

    def __init__(self, source: str, findings: list[str]) -> None:
        """List all findings at once, so that one edit of the file can mend them all."""
        self.source, self.findings = source, list(findings)
        super().__init__(f"{source}: " + "; ".join(self.findings))


class MeshError(HexapodError):
    """A mesh file cannot be used.

    Attributes:
        file: its path.
        reason: what is wrong with it.
    """

    def __init__(self, file: str, reason: str) -> None:
        """Name the file in front of the reason."""
        self.file, self.reason = file, reason
        super().__init__(f"mesh {file}: {reason}.")


class UnknownNameError(HexapodError, KeyError):
    """A robot, joint, link, foot or gait of that name does not exist."""

    def __init__(self, kind: str, name: str, known: list[str]) -> None:
        """Say which names of this kind exist."""
        self.kind, self.name, self.known = kind, name, list(known)
        super().__init__(f"no {kind} named {name!r}; known: {', '.join(self.known) or 'none'}.")

    def __str__(self) -> str:
        """Return the message itself (KeyError would print its repr)."""
        return str(self.args[0])


class StateError(HexapodError, ValueError):
    """A state (q, v) has the wrong shape, is not finite, or its quaternion is off unit norm."""


class SensorError(HexapodError, ValueError):
    """A reading that a controller cannot use.

    Attributes:
        reading: which quantity, of which joint or foot.
        value: what was read.
        time: of the measurement [s].
        row: of the run in lock-step.
    """

    def __init__(self, reading: str, value: float, time: float, row: int) -> None:
        """Compose the message from its parts."""
        self.reading, self.value, self.time, self.row = reading, value, time, row
        super().__init__(
            f"{reading} reads {value:g} at t = {time:g} s (run {row} of the lock-step): must be "
            "finite. Repair the sensor, or let the controller around it hold the last good value."
        )


class ReachError(HexapodError, ValueError):
    """A foot target is outside a leg's reach or its joint limits.

    Attributes:
        leg: name of the leg.
        excess: how far the target lies outside the reach [m] (0 where a joint limit stops it).
        brief: the reason in a few words.
    """

    def __init__(self, leg: str, message: str, excess: float = 0.0, brief: str = "") -> None:
        """Name the leg in front of the message."""
        self.leg, self.excess = leg, excess
        self.brief = brief or f"leg {leg} reaches no further"
        super().__init__(f"leg {leg}: {message}")


class GaitError(HexapodError, ValueError):
    """A gait request that this robot cannot walk, with the largest (or smallest) that it can.

    Attributes:
        quantity: what to change: "stroke", "duty", "lift", "cycle_time", ...
        limit: the largest or smallest value of `quantity` that works; None where none does.
    """

    def __init__(self, message: str, quantity: str, limit: float | None) -> None:
        """Keep the limit beside the message."""
        self.quantity, self.limit = quantity, limit
        super().__init__(message)


class JointRangeError(HexapodError, ValueError):
    """A joint of a motion that is to run on a robot leaves what a joint or its servo can do.

    Attributes:
        joint: name of the joint.
        time: when, from the start of the motion [s].
        quantity: "angle" or "rate".
        value: what it comes to [rad or rad/s; of sliding joints m or m/s].
        low: least value that is allowed.
        high: largest value that is allowed.
    """

    def __init__(
        self,
        joint: str,
        time: float,
        quantity: str,
        value: float,
        low: float,
        high: float,
        *,
        by: str,
        turning: bool = True,
    ) -> None:
        """Compose the message from its parts.

        `by` is what sets the range, and the way out; `turning` is false of a joint that slides.
        """
        self.joint, self.time, self.quantity = joint, time, quantity
        self.value, self.low, self.high = value, low, high
        unit = ("rad" if turning else "m") + ("/s" if quantity == "rate" else "")
        super().__init__(
            f"joint {joint}, {quantity} = {value:.4f} {unit} at t = {time:.4g} s: must be from "
            f"{low:.4f} to {high:.4f} {unit} {by}"
        )


class UserCodeError(HexapodError):
    """Code that a run calls has raised: a controller of yours, or the callback `progress`.

    `__cause__` is what it raised.

    Attributes:
        call: what was called, such as "MyController.update".
        time: simulated time at which it was called [s]; None where no run was under way.
        trace: as of `HexapodError`.
        results: what a batch had done, in the order of its cases, None for the rest; else None.
    """

    def __init__(self, call: str, cause: BaseException, time: float | None = None) -> None:
        """Name call, time and cause."""
        self.call, self.time = call, time
        self.results: list[Any] | None = None
        at = "" if time is None else f" at t = {time:g} s"
        super().__init__(f"{call}{at} raised {_described(cause)}")


def _described(error: BaseException) -> str:
    """Return type and text of an exception; the text may raise one itself."""
    kind = type(error).__name__
    try:
        return f"{kind}: {error}" if str(error) else kind
    except Exception:
        return kind


class DivergenceError(HexapodError):
    """A simulation left the finite world.

    Attributes:
        trace: all samples up to the last good one; None of a run that keeps none.
    """

    def __init__(self, message: str, trace: Any) -> None:
        """Keep the trace up to the failure."""
        self.trace = trace
        super().__init__(message)


class WorkLimitError(DivergenceError):
    """A run was ended because it had used up what it may.

    Attributes:
        trace: as of `DivergenceError`.
        limit: what it has reached: the name of an attribute of `WorkLimits`.
    """

    def __init__(self, message: str, trace: Any, limit: str = "") -> None:
        """Keep the limit beside the message."""
        self.limit = limit
        super().__init__(message, trace)


class SimulationInterrupted(HexapodError):
    """Ctrl-C during a simulation.

    Attributes:
        trace: what a single run had done; None of a batch, or of a run still being planned.
        results: what a batch had done, in the order of its cases, None for the rest; else None.
    """

    def __init__(
        self,
        message: str,
        trace: Any,
        results: list[Any] | None = None,
    ) -> None:
        """Keep what was done up to the interruption."""
        self.trace, self.results = trace, results
        super().__init__(message)


class StudyInterrupted(SimulationInterrupted):
    """Ctrl-C during a study, such as `compare` or `tune`.

    Attributes:
        result: what the study returns, of the runs that were done; None where that is nothing.
    """

    def __init__(self, message: str, result: Any) -> None:
        """Keep what was done up to the interruption."""
        self.result = result
        super().__init__(message, None)


class MissingPackageError(HexapodError, ImportError):
    """An optional package is not installed that something needs.

    Attributes:
        name: of the package.
        extra: of this package, with which it is installed.
        wanted: what needs it.
    """

    def __init__(self, name: str, extra: str, wanted: str) -> None:
        """Compose the message from its parts."""
        self.extra, self.wanted = extra, wanted
        super().__init__(
            f"{wanted}: needs {name}, which is not installed: pip install 'hexapod-pin[{extra}]' "
            "brings it."
        )
        self.name = name


class FileConflictError(HexapodError):
    """A file that a command is to write is one of its inputs, or another of its outputs.

    Attributes:
        name: the option that names the file to write.
        value: its path.
    """

    def __init__(self, name: str, value: str, message: str) -> None:
        """Name option and file in front of the message."""
        self.name, self.value = name, value
        super().__init__(f"{name} {value}: {message}")


class TraceFileError(HexapodError):
    """A result file cannot be written or read: missing, truncated, or of another schema."""


class SweepStoreError(HexapodError):
    """The store of a sweep cannot be used: missing, damaged, no store, of a newer schema.

    Attributes:
        path: of the store.
        kept: how many cases it holds; None where that cannot be told.
    """

    def __init__(self, path: str, message: str, kept: int | None = None) -> None:
        """Name the file in front of the message."""
        self.path, self.kept = str(path), kept
        super().__init__(f"{path}: {message}")


class StoreExistsError(SweepStoreError):
    """There is a store of that name already, and the sweep was not told to go on with it."""


class StoreLockedError(SweepStoreError):
    """Another process writes to the store."""


class StoreFullError(SweepStoreError):
    """The disk is full: what was committed before is kept, and the sweep can go on later."""


class OtherStudyError(SweepStoreError):
    """The store is that of another study, or of other versions.

    Attributes:
        stored: digest (or versions) that the store was begun with.
        given: digest (or versions) of now.
    """

    def __init__(self, path: str, message: str, stored: str, given: str) -> None:
        """Keep both beside the message."""
        self.stored, self.given = stored, given
        super().__init__(path, message)


class WorkersError(HexapodError):
    """Workers cannot run the cases of a sweep: they are gone, or have another study or release.

    Attributes:
        kept: how many cases the store holds.
    """

    def __init__(self, message: str, kept: int) -> None:
        """Keep the number beside the message."""
        self.kept = kept
        super().__init__(message)


class NotRecordedError(HexapodError):
    """A trace lacks samples that something needs: they were not recorded.

    Attributes:
        name: the array, as of `Trace`.
        record: the groups to record so that it is there, what is there now included.
    """

    def __init__(self, name: str, record: list[str]) -> None:
        """Compose the message from its parts."""
        self.name, self.record = name, list(record)
        super().__init__(
            f"the trace holds no {name}: it was not recorded. Simulate again with "
            f"record={self.record} (`hexapod-pin walk --record {','.join(self.record)}`)."
        )


class NotPicklableError(HexapodError, TypeError):
    """Something that lives in one process alone was to be pickled or copied.

    Attributes:
        name: what it is.
        instead: what can be sent in its place.
    """

    def __init__(self, name: str, instead: str, hint: str) -> None:
        """Name both; `hint` says what to do with the latter."""
        self.name, self.instead = name, instead
        super().__init__(f"a {name} can be neither pickled nor copied: send {instead}. {hint}")


class ViewerError(HexapodError):
    """The browser viewer could not be started or reached; results are not affected."""


class ResourceError(HexapodError):
    """The system does not give what a command needs: a working folder, threads, memory.

    Attributes:
        name: what it is: "working folder", "threads", "memory", "open files", a table.
        reason: what the system says, or its limit.
    """

    def __init__(self, name: str, reason: str, hint: str) -> None:
        """Compose the message; `hint` is the way out."""
        self.name, self.reason = name, reason
        super().__init__(f"{name}: {reason}. {hint}")
