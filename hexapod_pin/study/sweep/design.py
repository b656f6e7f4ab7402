"""Where in the unit cube an uncertain study is sampled."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field, Strict

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, ResourceError
from hexapod_pin.spec import Spec
from hexapod_pin.study.sweep.fields import known_name

MOST_SAMPLES = 2**20
"""Most samples of a design."""

INDICES = "sobol-indices"
"""The design from which sensitivity indices are found."""

Whole = Annotated[int, Strict()]


class Design(Spec):
    """How uncertain inputs are sampled.

    Attributes:
        kind: "sobol" (scrambled), "halton" (scrambled), "latin-hypercube", "random", or
            "sobol-indices": Saltelli's matrices A, B and AB_i, samples * (inputs + 2) rows.
        samples: rows of the design, of "sobol-indices" those of A; a power of two with Sobol's
            points, whose balance needs it.
        seed: the same seed gives the same points.
    """

    kind: str
    samples: Annotated[Whole, Field(ge=1, le=MOST_SAMPLES)]
    seed: Annotated[Whole, Field(ge=0)] = 0

    def __init__(self, /, **fields: Any) -> None:
        """Check kind and samples.

        Raises:
            ParameterError: no such design, or samples that it cannot have.
        """
        super().__init__(**fields)
        known_name("Design.kind", self.kind, KINDS)
        if self.kind in ("sobol", INDICES):
            _require_power_of_two(self.samples)

    def rows(self, inputs: int) -> int:
        """Return the number of rows for so many uncertain inputs."""
        return self.samples * (inputs + 2 if self.kind == INDICES else 1)

    def cube(self, inputs: int) -> Array:
        """Return points of the unit cube. Shape (rows, inputs)."""
        return KINDS[self.kind](inputs, self.samples, np.random.default_rng(self.seed))


def _require_power_of_two(samples: int) -> None:
    if samples & (samples - 1) or samples < 2:
        below = max(2, 1 << (samples.bit_length() - 1))
        nearest = f"{below} or {2 * below}" if samples > 2 else "2"
        raise ParameterError(
            "Design.samples", samples, f"a power of two with Sobol's points: {nearest}",
            "halton, latin-hypercube and random take any number.",
        )  # fmt: skip


def _require_directions(inputs: int) -> None:
    """Look whether SciPy has the table of Sobol's directions, which it reads from a file.

    Where it cannot, it continues and draws one point again and again; the reason goes to the hooks.

    Raises:
        ResourceError: it has not.
    """
    from scipy.stats import qmc

    reasons = list[str]()
    hooks = sys.excepthook, sys.unraisablehook
    sys.excepthook = lambda kind, error, trace: reasons.append(str(error))
    sys.unraisablehook = lambda found: None  # the same once more
    try:
        second = qmc.Sobol(inputs, scramble=False).random(2)[1]
    finally:
        sys.excepthook, sys.unraisablehook = hooks
    if not np.array_equal(second, np.full(inputs, 0.5)):
        raise ResourceError(
            "SciPy's table of Sobol's directions", f"it cannot be read ({'; '.join(reasons)})",
            "Raise the limit of open files (ulimit -n), or repair the installation of SciPy.",
        )  # fmt: skip


def _sobol(inputs: int, samples: int, rng: np.random.Generator) -> Array:
    from scipy.stats import qmc

    _require_directions(inputs)
    return np.asarray(qmc.Sobol(inputs, scramble=True, seed=rng).random(samples))


def _halton(inputs: int, samples: int, rng: np.random.Generator) -> Array:
    from scipy.stats import qmc

    return np.asarray(qmc.Halton(inputs, scramble=True, seed=rng).random(samples))


def _latin(inputs: int, samples: int, rng: np.random.Generator) -> Array:
    from scipy.stats import qmc

    return np.asarray(qmc.LatinHypercube(inputs, seed=rng).random(samples))


def _random(inputs: int, samples: int, rng: np.random.Generator) -> Array:
    return rng.random((samples, inputs))


def _saltelli(inputs: int, samples: int, rng: np.random.Generator) -> Array:
    """Return A, B and AB_1 ... AB_d, one after the other; AB_i is A with column i of B.

    A and B are the halves of Sobol's points in 2 d dimensions (Saltelli et al. 2010).
    """
    both = _sobol(2 * inputs, samples, rng)
    a, b = both[:, :inputs], both[:, inputs:]
    mixed = np.repeat(a[None], inputs, axis=0)
    for column in range(inputs):
        mixed[column, :, column] = b[:, column]
    return np.concatenate([a, b, mixed.reshape(-1, inputs)])


KINDS: Mapping[str, Callable[[int, int, np.random.Generator], Array]] = {
    "sobol": _sobol,
    "halton": _halton,
    "latin-hypercube": _latin,
    "random": _random,
    INDICES: _saltelli,
}
"""The designs by their names in a study file."""
