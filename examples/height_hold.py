"""A feedback controller of ten lines: hold the trunk's height by what the feet carry.

Under a load the servos give way and the trunk sinks. The controller reads the force on every foot
at 200 Hz, knows from the servos' stiffness how far that leg gives way, and puts the foot as much
lower. Prints how far the trunk sinks with and without it, empty and under 0.5 kg.
Writes `height_hold.png`.
"""

import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp
from hexapod_pin.control import leg_group


class HeightHold:
    """Puts each foot lower by the sag that its load causes; `compliance` [m/N] of one leg."""

    period = 0.005  # s between ticks

    def __init__(self, robot: hp.Robot, compliance: float) -> None:
        """Keep the legs' kinematics and the compliance."""
        self.legs, self.compliance = leg_group(robot), compliance

    def start(self, scene: hp.Scene, batch: int) -> np.ndarray:
        """Return how far each foot is put down at first. Shape (B, 6) [m]."""
        return np.zeros((batch, 6))

    def update(self, time: float, m: hp.feedback.Measurement, down: np.ndarray):
        """Return the command, and how far the feet are put down now."""
        down = down + 0.05 * (self.compliance * m.foot_force[..., 2] - down)
        feet = self.legs.neutral_feet - down[..., None] * np.array([0.0, 0.0, 1.0])
        return hp.feedback.Command(self.legs.joint_angles(feet), ramp=True), down


def leg_compliance(scene: hp.Scene) -> float:
    """Return how far a standing foot gives way upwards per force, mean of the legs [m/N].

    The foot does not slip: stiffness at the foot is J^-T kp J^-1, of which the z-z entry counts.
    """
    legs = leg_group(scene.robot).kinematics
    inverse = np.linalg.inv(legs.jacobian(legs.posture[:, None])[:, 0])  # (6, 3, 3), rad/m
    return float(np.mean(1.0 / (SERVO_STIFFNESS * np.sum(inverse[:, :, 2] ** 2, axis=1))))


SERVO_STIFFNESS = 20.0  # N m/rad, soft


def main(folder: Path = Path()) -> dict[str, float]:
    """Return the sag of the trunk for each case [m]."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    robot = hp.load_robot("kharagpur")
    servo = hp.Servo(kp=SERVO_STIFFNESS, kd=0.4)
    sag = {}
    for load, loads in (
        ("empty", []),
        ("0.5 kg", [hp.Payload("base_link", mass=0.5, position=(0.0, 0.0, 0.05))]),
    ):
        scene = hp.Scene(robot, servo=servo, loads=loads)
        for name, control in (
            ("posture held", hp.HoldPosture()),
            ("height held", HeightHold(robot, leg_compliance(scene))),
        ):
            trace = hp.simulate(scene, control, duration=2.0, accuracy=1e-5)
            sag[f"{load}, {name}"] = float(trace.q[0, 2] - trace.q[-1, 2])
            print(f"{load}, {name}: {1e3 * sag[f'{load}, {name}']:.2f} mm lower than at first")
            sunk = 1e3 * (trace.q[:, 2] - trace.q[0, 2])
            axes.plot(trace.time, sunk, label=f"{load}, {name}")
    axes.set(xlabel="time [s]", ylabel="height of the trunk above its start [mm]")
    axes.legend()
    figure.savefig(folder / "height_hold.png", dpi=120)
    return sag


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
