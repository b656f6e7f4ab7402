"""Drake: its discrete contact solvers SAP, TAMSI and lagged, and the error-controlled CENIC."""

from __future__ import annotations

import logging
import tempfile
import time
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from hexapod_pin.benchmark.engines.engine import BASE, EngineSweep, Problem
from hexapod_pin.benchmark.work_precision.measure import RunOutcome

STEPS = (5e-3, 2.5e-3, 1e-3, 5e-4, 2.5e-4, 1e-4)
QUICK_STEPS = (1e-3, 5e-4)
ACCURACIES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
QUICK_ACCURACIES = (1e-2, 1e-3, 1e-4)
DISCRETE = {"SAP": "sap", "TAMSI": "tamsi", "lagged": "lagged"}
CENIC = "CENIC"
STIFFNESS = 1e4
"""Of a contact [N/m]; near MuJoCo's default. A pair of equal geometries gets half of each."""

DISSIPATION = 5.0
"""Hunt-Crossley d [s/m]."""

STICTION = 1e-3
"""Slip speed of the regularised friction [m/s]."""


@dataclass
class Drake:
    """One problem in Drake. A method at one setting is built once and started again."""

    problem: Problem
    name: str = "Drake"
    law: str = "point contact 1e4 N/m, Hunt-Crossley 5 s/m, friction regularised at 1 mm/s"
    _built: dict[tuple[str, str, float], Any] = field(default_factory=dict, repr=False)

    def sweeps(self, *, quick: bool) -> list[EngineSweep]:
        """Return SAP and lagged; TAMSI and CENIC too where the servos have no torque limit."""
        steps = QUICK_STEPS if quick else STEPS
        fine = steps[-1] / 10.0
        found = [
            EngineSweep(name, "step", steps, (name, "step", fine), (name, "step", 2.0 * fine))
            for name in DISCRETE
            if self._own_servos(name) or not np.isfinite(self.problem.limit).any()
        ]
        if not np.isfinite(self.problem.limit).any():
            accuracies = QUICK_ACCURACIES if quick else ACCURACIES
            reference = (CENIC, "step", fine)
            found.append(
                EngineSweep(CENIC, "accuracy", accuracies, reference, (CENIC, "step", 2 * fine))
            )
        return found

    def run(self, method: str, kind: str, value: float, *, exact: bool = False) -> RunOutcome:
        """Run the problem; "step" on CENIC is its fixed step [s]. See `Engine.run`."""
        key = (method, kind, value)
        if key not in self._built:
            self._built[key] = self._build(method, kind, value)
        plant, diagram, simulator, first = self._built[key]
        try:
            return self._walk(plant, diagram, simulator, first)
        except RuntimeError as error:
            return RunOutcome.failed(f"failed: {str(error).splitlines()[0][:80]}")

    def _walk(self, plant: Any, diagram: Any, simulator: Any, first: Any) -> RunOutcome:
        task = self.problem.task
        context = simulator.get_mutable_context()
        port = diagram.get_input_port(0)
        still = np.zeros(len(self.problem.joints))
        trunk = plant.GetBodyByName(BASE).floating_positions_start() + 4
        own = plant.GetMyMutableContextFromRoot(context)
        context.SetTime(0.0)
        plant.SetPositionsAndVelocities(own, first)
        port.FixValue(context, np.concatenate([self.problem.set_points[0], still]))
        simulator.Initialize()
        places = np.empty((task.samples + 1, 3))
        places[0] = task.initial.q[:3]
        before = _steps(simulator, plant)
        begin = time.perf_counter()
        for k, wanted in enumerate(self.problem.set_points):
            port.FixValue(context, np.concatenate([wanted, still]))
            simulator.AdvanceTo((k + 1) * task.sample)
            places[k + 1] = plant.GetPositions(own)[trunk : trunk + 3]
        wall = time.perf_counter() - begin
        if not np.isfinite(places).all():
            return RunOutcome.failed("diverged", wall)
        return RunOutcome(places, None, wall, None, _steps(simulator, plant) - before, None)

    def _build(self, method: str, kind: str, value: float) -> tuple[Any, Any, Any, Any]:
        """Return plant, diagram, simulator and the first state."""
        framework = import_module("pydrake.systems.framework")
        analysis = import_module("pydrake.systems.analysis")
        logging.getLogger("drake").setLevel(logging.ERROR)
        builder = framework.DiagramBuilder()
        plant = self._plant(builder, method, value if method in DISCRETE else 0.0)
        actuators = [
            plant.AddJointActuator(name, plant.GetJointByName(name), float(min(limit, 1e6)))
            for name, limit in zip(self.problem.joints, self.problem.limit, strict=True)
        ]
        if self._own_servos(method):
            tree = import_module("pydrake.multibody.tree")
            gains = zip(actuators, self.problem.kp, self.problem.kd, strict=True)
            for actuator, kp, kd in gains:
                actuator.set_controller_gains(tree.PdControllerGains(p=float(kp), d=float(kd)))
        plant.Finalize()
        if self._own_servos(method):
            model = plant.GetBodyByName(BASE).model_instance()
            builder.ExportInput(plant.get_desired_state_input_port(model), "wanted")
        else:
            self._outer_servos(builder, plant)
        diagram = builder.Build()
        simulator = analysis.Simulator(diagram)
        if method == CENIC:
            self._error_control(analysis, simulator, kind, value)
        return plant, diagram, simulator, self._first(plant)

    def _plant(self, builder: Any, method: str, step: float) -> Any:
        """Add the robot and the ground."""
        geometry = import_module("pydrake.geometry")
        multibody = import_module("pydrake.multibody.plant")
        parsing = import_module("pydrake.multibody.parsing")
        config = multibody.MultibodyPlantConfig(
            time_step=step, contact_model="point", stiction_tolerance=STICTION,
            discrete_contact_approximation=DISCRETE.get(method, "lagged"),
            use_sampled_output_ports=False,
        )  # fmt: skip
        plant, graph = multibody.AddMultibodyPlant(config, builder)
        defaults = geometry.SceneGraphConfig()
        touch = defaults.default_proximity_properties
        touch.compliance_type = "undefined"
        touch.point_stiffness, touch.hunt_crossley_dissipation = 2.0 * STIFFNESS, DISSIPATION
        touch.relaxation_time = 0.01
        touch.static_friction = touch.dynamic_friction = self.problem.mu
        graph.set_config(defaults)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "robot.urdf"
            path.write_text(self.problem.urdf, encoding="utf-8")
            parsing.Parser(plant).AddModels(str(path))
        surface = geometry.ProximityProperties()
        geometry.AddContactMaterial(
            dissipation=DISSIPATION, point_stiffness=2.0 * STIFFNESS, properties=surface,
            friction=multibody.CoulombFriction(self.problem.mu, self.problem.mu),
        )  # fmt: skip
        surface.AddProperty("material", "relaxation_time", 0.01)
        pose = geometry.HalfSpace.MakePose([0, 0, 1], [0, 0, self.problem.height])
        plant.RegisterCollisionGeometry(
            plant.world_body(), pose, geometry.HalfSpace(), "ground", surface
        )
        plant.mutable_gravity_field().set_gravity_vector(self.problem.gravity)
        return plant

    def _outer_servos(self, builder: Any, plant: Any) -> None:
        """Add the servos as a system of their own, for TAMSI and CENIC."""
        controllers = import_module("pydrake.systems.controllers")
        joints = [plant.GetJointByName(name) for name in self.problem.joints]
        n = len(joints)
        chosen = np.zeros((2 * n, plant.num_multibody_states()))
        for k, joint in enumerate(joints):
            chosen[k, joint.position_start()] = 1.0
            chosen[n + k, plant.num_positions() + joint.velocity_start()] = 1.0
        servos = builder.AddSystem(
            controllers.PidController(
                state_projection=chosen, output_projection=np.eye(n),
                kp=self.problem.kp, ki=np.zeros(n), kd=self.problem.kd,
            )
        )  # fmt: skip
        state = servos.get_input_port_estimated_state()
        builder.Connect(plant.get_state_output_port(), state)
        builder.Connect(servos.get_output_port_control(), plant.get_actuation_input_port())
        builder.ExportInput(servos.get_input_port_desired_state(), "wanted")

    def _error_control(self, analysis: Any, simulator: Any, kind: str, value: float) -> None:
        fixed = kind == "step"
        config = analysis.SimulatorConfig(
            integration_scheme="cenic", accuracy=1e-3 if fixed else value, use_error_control=True,
            max_step_size=value if fixed else self.problem.task.sample, target_realtime_rate=0.0,
        )  # fmt: skip
        analysis.ApplySimulatorConfig(config, simulator)
        simulator.get_mutable_integrator().set_fixed_step_mode(fixed)

    @staticmethod
    def _own_servos(method: str) -> bool:
        """Whether Drake's own implicit servos work with a method."""
        return method in ("SAP", "lagged")

    def _first(self, plant: Any) -> Any:
        """Return the first state in Drake's order: quaternion w first, world spin, then speed."""
        import pinocchio as pin

        state = self.problem.task.initial
        turned = pin.Quaternion(state.q[3:7]).toRotationMatrix()
        trunk = plant.GetBodyByName(BASE)
        q, v = np.zeros(plant.num_positions()), np.zeros(plant.num_velocities())
        place = trunk.floating_positions_start()
        q[place : place + 7] = np.concatenate([state.q[[6, 3, 4, 5]], state.q[:3]])
        rate = trunk.floating_velocities_start_in_v()
        v[rate : rate + 6] = np.concatenate([turned @ state.v[3:6], turned @ state.v[:3]])
        for name, angle, speed in zip(self.problem.joints, state.q[7:], state.v[6:], strict=True):
            joint = plant.GetJointByName(name)
            q[joint.position_start()], v[joint.velocity_start()] = angle, speed
        return np.concatenate([q, v])


def _steps(simulator: Any, plant: Any) -> int:
    """Return the steps so far, of the plant where it is discrete, else of the integrator."""
    if plant.time_step() > 0.0:
        return int(simulator.get_num_discrete_updates())
    return int(simulator.get_integrator().get_num_steps_taken())
