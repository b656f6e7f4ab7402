"""Compare gaits at one walking speed: torque, energy, and how many feet carry the robot.

Prints, per gait: fewest feet down, largest RMS and peak torque of any femur joint, and the cost of
transport. Writes `choose_a_gait.png`.
"""

import sys
from pathlib import Path

import hexapod_pin as hp

SPEED = 0.06  # m/s
CYCLE_TIME = 1.8  # s
DURATION = 9.0  # s, five cycles
GAITS = {
    "tripod": hp.Gait.tripod,
    "tetrapod": hp.Gait.tetrapod,
    "ripple": hp.Gait.ripple,
    "wave": hp.Gait.wave,
}


def at_speed(gait: hp.Gait) -> hp.Gait:
    """Return the gait with the stroke that walks at `SPEED`."""
    stroke = SPEED * gait.duty * CYCLE_TIME
    return hp.Gait(**{**gait.model_dump(), "stroke": stroke, "cycle_time": CYCLE_TIME})


def main(folder: Path = Path()) -> dict[str, hp.results.TorqueBudget]:
    """Return the torque budget of every gait."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    budgets = {}
    print("gait       feet down   RMS [N m]   peak [N m]   cost of transport")
    for name, make in GAITS.items():
        gait = at_speed(make())
        trace = hp.simulate(scene, hp.KinematicControl(gait), duration=DURATION)
        budget = budgets[name] = hp.torque_budget(trace)
        femur = budget.kind("femur")
        print(
            f"{name:10} {gait.minimum_feet_down:9} {femur.rms.torque_rms:11.3f}"
            f" {femur.peak.torque_peak:12.3f} {budget.cost_of_transport:19.3f}"
        )
    draw(budgets, folder / "choose_a_gait.png")
    return budgets


def draw(budgets: dict[str, hp.results.TorqueBudget], path: Path) -> None:
    """Draw the torques of coxa, femur and tibia joints beside each other, gait by gait."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    for k, kind in enumerate(("coxa", "femur", "tibia")):
        places = [n + 0.25 * (k - 1) for n in range(len(budgets))]
        peaks = [budget.kind(kind).peak.torque_peak for budget in budgets.values()]
        axes.bar(places, peaks, 0.2, alpha=0.4, color=f"C{k}", label=f"{kind}, peak")
        rms = [budget.kind(kind).rms.torque_rms for budget in budgets.values()]
        axes.bar(places, rms, 0.2, color=f"C{k}", label=f"{kind}, RMS")
    axes.set_xticks(range(len(budgets)), list(budgets))
    axes.set(ylabel="torque [N m]", title=f"walking at {SPEED:g} m/s")
    axes.legend(ncols=3, fontsize="small")
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
