"""Train a small linear policy to walk at a commanded speed, from standing still.

The policy knows the clock of a gait and which legs form its two sets of three, but neither how a
leg moves nor how far: ten numbers, found by CMA-ES with the package `cmaes`. Twelve
policies walk at a time, in lock-step on two threads. Prints the return of a generation and that of
the trained policy on grounds that it has not seen. Writes `policy.txt` and `learned_walk.html`.
"""

import sys
import time
from pathlib import Path

import gymnasium
import numpy as np

import hexapod_pin as hp

TASK = {
    "robot": "kharagpur", "speed": 0.1, "gait": "tripod", "cycle_time": 0.8,
    "slope": (0.0, 0.05), "friction": (0.5, 0.9), "observe": ["phase", "heading", "q"],
    "period": 0.04, "method": "implicit-euler", "step": 2e-3,  # cheaper than the defaults
}  # fmt: skip
SETS = {"lf": 1.0, "lm": -1.0, "lr": 1.0, "rf": -1.0, "rm": 1.0, "rr": -1.0}
POPULATION, GENERATIONS, SEED = 12, 36, 1
UNSEEN = range(278325, 278341)  # drawn once, after all settings were chosen


class Policy:
    """Actions from observations: each leg moves as its set of three does, mirrored on the right.

    Parameters: 3 joints x (sine, cosine, constant), and how a heading shortens the strokes of the
    side towards which the robot should turn.
    """

    size = 10

    def __init__(self, robot: hp.Robot) -> None:
        """Find each joint's leg."""
        legs = {joint: leg.name for leg in robot.legs for joint in leg.joints}
        kinds = {joint: k for leg in robot.legs for k, joint in enumerate(leg.joints)}
        names = robot.joint_names
        self.kind = np.array([kinds[name] for name in names])
        self.set = np.array([SETS[legs[name]] for name in names])
        self.side = np.array([1.0 if legs[name][0] == "l" else -1.0 for name in names])
        self.mirror = np.where(self.kind == 0, self.side, 1.0)

    def actions(self, parameters: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Return actions of B policies (B, 10) for what each has seen (B, size). Shape (B, 18)."""
        sine, cosine, constant = np.moveaxis(parameters[:, :9].reshape(-1, 3, 3), 2, 0)
        swing = sine[:, self.kind] * seen[:, :1] + cosine[:, self.kind] * seen[:, 1:2]
        turning = 1.0 + parameters[:, 9:] * seen[:, 2:3] * self.side
        moved = self.set * swing * np.where(self.kind == 0, turning, 1.0)
        return self.mirror * (moved + constant[:, self.kind])


def returns(env: gymnasium.vector.VectorEnv, policy: Policy, parameters: np.ndarray, seeds: list):
    """Return what B policies earn in one episode each. Shape (B,)."""
    seen, _ = env.reset(seed=seeds)
    earned, going = np.zeros(len(parameters)), np.ones(len(parameters), dtype=bool)
    while going.any():
        seen, reward, fallen, over, _ = env.step(policy.actions(parameters, seen))
        earned += np.where(going, reward, 0.0)
        going &= ~(fallen | over)
    return earned


def main(
    folder: Path = Path(), generations: int = GENERATIONS, duration: float = 4.0
) -> dict[str, float]:
    """Return the mean returns on unseen grounds, standing and trained, and the distance walked.

    Args:
        folder: where the files go.
        generations: of 12 policies each.
        duration: of an episode [s].
    """
    from cmaes import CMA

    task = {**TASK, "duration": duration}
    env = hp.rl.WalkVectorEnv(POPULATION, threads=2, **task)
    policy = Policy(env.walkers[0].robot)
    search = CMA(mean=np.zeros(Policy.size), sigma=0.15, seed=SEED, population_size=POPULATION)
    begin, best = time.perf_counter(), (-np.inf, np.zeros(Policy.size))
    for generation in range(generations):
        tried = np.array([search.ask() for _ in range(POPULATION)])
        earned = returns(env, policy, tried, [generation] * POPULATION)  # one ground for all
        search.tell([(row, -value) for row, value in zip(tried, earned, strict=True)])
        best = max(best, (float(earned.max()), tried[earned.argmax()]), key=lambda one: one[0])
        if generation % 5 == 4 or generation == generations - 1:
            took = time.perf_counter() - begin
            print(f"generation {generation + 1}: best {earned.max():.2f}, {took:.0f} s")
    trained = search.mean if generations > 20 else best[1]

    unseen = hp.rl.WalkVectorEnv(len(UNSEEN), threads=2, **task)
    found = {}
    for name, parameters in (("standing", np.zeros(Policy.size)), ("trained", trained)):
        rows = np.tile(parameters, (len(UNSEEN), 1))
        found[name] = float(returns(unseen, policy, rows, list(UNSEEN)).mean())
        most = f"{found[name]:.2f} of at most {1.5 * duration:g}"
        print(f"{name}: return {most}, mean of {len(UNSEEN)} grounds")
    print(f"integration: {env.integration} of each step")

    shown = hp.rl.WalkEnv(record=True, **task)
    seen, _ = shown.reset(seed=UNSEEN[0])
    over = False
    while not over:
        action = policy.actions(trained[None], seen[None])[0]
        seen, _, fallen, ended, info = shown.step(action)
        over = fallen or ended
    found["distance"] = float(info["x"])
    np.savetxt(
        folder / "policy.txt",
        trained,
        header="sine, cosine, constant of coxa, femur, tibia; turning",
    )
    hp.view.write_html(shown.trace(), folder / "learned_walk.html")
    asked = TASK["speed"] * duration
    print(f"walked {found['distance']:.3f} m in {duration:g} s; {asked:g} m were commanded")
    return found


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
