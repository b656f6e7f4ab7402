"""Is the accuracy kept with drives as they are: gear friction, backlash, firmware, sag and heat?"""

from __future__ import annotations

from dataclasses import replace

from random_scenes.real_drives import REAL_DRIVES

from studies.promise.promise import METHODS_JUDGED, promise
from studies.study import StudyReport


def promise_drives(
    *, scenes: int = 100, seed: int = 0, only: int = -1, methods: str = METHODS_JUDGED,
    accuracies: str = "1e-3,1e-4,1e-5", file: str = "", processes: int = 1,
) -> StudyReport:  # fmt: skip
    """The true error of robots with drives as they are against the accuracy asked for.

    Gear friction by load (identified servos, M6), backlash of a leg's three joints, and firmware
    on a weak battery with motors that warm; encoders are fine. Options as of `promise`.
    """
    found = promise(
        scenes=scenes, seed=seed, only=only, methods=methods, accuracies=accuracies,
        kinds=",".join(REAL_DRIVES), file=file, processes=processes,
    )  # fmt: skip
    return replace(found, title="An error stated is an error kept: drives as they are")
