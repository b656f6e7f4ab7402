"""Settings with which a short run of each method is quick and near the others."""

from __future__ import annotations

METHODS: dict[str, dict[str, float]] = {
    "extrapolated-euler": {"accuracy": 1e-5},
    "ndf": {"accuracy": 1e-6},
    "dop853": {"accuracy": 1e-6},
    "robust": {"step": 1e-3},
    "implicit-euler": {"step": 1e-3},
    "rk4": {"step": 2e-5},
}
