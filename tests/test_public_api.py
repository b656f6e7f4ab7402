"""The public names of the package, and what importing it costs."""

from __future__ import annotations

import importlib
import inspect
import subprocess
import sys

import pytest
from refusals import refused

import hexapod_pin as hp

HEAVY = (
    *(
        "pinocchio",
        "scipy",
        "xarray",
        "meshcat",
        "yourdfpy",
        "matplotlib",
        "fpdf",
        "h5py",
        "pydantic",
    ),
    *("trimesh", "collada", "xacro", "PIL"),
)

PROMISED = """
__version__ AdamsCoulomb AdamsImpact Amplification amplification ArcWalk assumed_inputs BatteryLoad
Blueprint BodyMotion BrownMcPhee Case Catalog Checkpoint Command compare Comparison Contact
Derating errors FeedbackController Flat FootControl FootForceSensing Gait gait_energy GaitEnergy
Groove Havsin HeightField Hermite HoldPosture HuntCrossley iterate_batch joint_demand joint_moments
JointDemand JointMoments JointMotion JointStops judge_peaks KelvinVoigt KinematicControl Ledge
Levelling load_case load_catalog load_gait_energy load_robot load_study load_summary load_sweep
load_torque_map load_trace LostLeg MassFactor Measurement Motor motor_budget motor_ranking
MotorBudget MotorRanking MotorRecord MotorSelection MotorUse open_sweep paper_motion Patch
PatchedGround Payload PeakVerdict PeakVerdicts Periodic phase_torques PhaseTorques Push Ramp
register_controller RelativeObjective RemovedMass Restitution Robot run_sweep SampledTrajectory
Scene Segment select_motors Sensor Sensors Servo Session ShakingGround simulate simulate_batch Sine
SlipPid Slope SmoothStep Stability stability Stairs State Step Step5 StickSlip study_grounds Sum
Summary SweepResult SweepStudy TanhCoulomb torque_budget torque_map TorqueBudget TorqueMap
TouchDown Trace Trunk tune TuningResult Uncertainty uncertainty urdf_path VelocityCommand view
VirtualSuspension walk_verdict WalkMetrics WalkVerdict Waypoints
WorkLimits write_study
""".split()


def test_exactly_the_promised_names_are_listed():
    """`__all__` holds each promised name once, and nothing else."""
    assert sorted(hp.__all__) == sorted(PROMISED)
    assert set(PROMISED) <= set(dir(hp))


@pytest.mark.parametrize("name", PROMISED)
def test_name_exists_and_is_documented(name: str):
    """Every listed name can be fetched and says what it is."""
    found = getattr(hp, name)
    if name != "__version__":
        assert (inspect.getdoc(found) or "").strip(), f"{name} has no docstring"


@pytest.mark.parametrize("name", [n for n in PROMISED if inspect.isclass(getattr(hp, n))])
def test_class_has_its_own_docstring(name: str):
    """A class does not merely inherit the docstring of its base."""
    assert (getattr(hp, name).__doc__ or "").strip()


def test_unknown_name_is_an_attribute_error_that_names_it():
    with refused(AttributeError, about=("walkies",)):
        _ = hp.walkies


def test_version_is_that_of_the_installed_package():
    from importlib.metadata import version

    assert hp.__version__ == version("hexapod-pin")


def test_front_doors_of_errors_and_view():
    """The modules reached as attributes hold what a script needs of them."""
    assert issubclass(hp.errors.GaitError, hp.errors.HexapodError)
    assert callable(hp.view.write_html)
    assert callable(hp.view.view)


def _loaded_after(statement: str) -> set[str]:
    code = f"import sys; {statement}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


@pytest.mark.parametrize("statement", ["import hexapod_pin", "import hexapod_pin.commands.app"])
def test_importing_loads_nothing_heavy(statement: str):
    """What takes long to import waits until it is used: `--help` and tab completion stay quick."""
    assert not _loaded_after(statement) & set(HEAVY)


def test_simulation_loads_no_viewer():
    """A torque run never pays for meshcat, yourdfpy or matplotlib."""
    loaded = _loaded_after("import hexapod_pin as hp; hp.simulate, hp.torque_budget, hp.load_robot")
    assert not loaded & {"meshcat", "yourdfpy", "matplotlib", "fpdf", "xarray"}


def test_controllers_load_no_scipy():
    """Its linear algebra takes a second to load; only the check of gains needs it."""
    assert "scipy" not in _loaded_after("import hexapod_pin as hp; hp.FootControl, hp.SlipPid")


ROOMS = """
robot drive control simulation results sweep view ground ground.contact ground.terrain
""".split()


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_has_one_door(room: str):
    """`__all__` of a room is sorted, complete, and each of its names has a docstring."""
    door = importlib.import_module(f"hexapod_pin.{room}")
    assert list(door.__all__) == sorted(set(door.__all__))
    for name in door.__all__:
        found = getattr(door, name)
        assert not callable(found) or (inspect.getdoc(found) or "").strip(), name


def test_importing_the_product_loads_no_evidence():
    """Hard cases and benchmarks load only with their commands."""
    statement = "import hexapod_pin as hp; [getattr(hp, name) for name in hp.__all__]"
    loaded = _loaded_after(statement)
    assert not [
        name
        for name in loaded
        if name.startswith(("hexapod_pin.validation", "hexapod_pin.benchmark"))
    ]
