"""The words of the page of S2's study; the numbers come from its file."""

HEAD = """
# S2's study

S2 walks the hexapod of IIT Kharagpur in ADAMS: joint motions are prescribed by STEP functions,
feet meet the ground by IMPACT and ADAMS friction, and the paper shows the joint motions (figure
3), the path of the aggregate centre of mass (figure 5), the joint torques (figure 6) and how they
depend on stroke and cycle time. This page repeats all of it with prescribed joints
([docs/drive.md](../drive.md)) and adds the paper's future work, the energy of gaits against speed.

```
python scripts/studies s2_study --out s2_study.nc  # all runs, one netCDF file
python scripts/studies s2_motion s2_study.nc docs/results  # figure 3
python scripts/studies s2_mass_center s2_study.nc docs/results  # figure 5
python scripts/studies s2_torques s2_study.nc docs/results  # figure 6
python scripts/studies s2_sweeps s2_study.nc docs/results  # torque; s2_energy: energy
python scripts/studies s2_page s2_study.nc docs/results  # this page
```

S2 prints no torque numbers. Its figure 3 shows joint **velocities** by STEP functions: they rise to
a plateau and fall back to 0 in each move. The break points cannot be read, so the ramps are
*assumed*: a tenth of each move, and a quarter for comparison. Two other readings of the text are
run beside it: angles by one STEP, and a constant rate in stance. Hip positions, foot radius and the
position of 0.631 kg are *assumed* ([urdf/README.md](../../urdf/README.md)). Joints are prescribed
unless servos are named. Lengths in mm, torques in N m.
"""

CLAIMS = """
The paper's statements that a simulation can test, each with our number. They are paraphrased from
its abstract, figures and section titles as far as these are known here; the full text was not
available, so a statement may be missing.
"""

MOTION = """
![Joint motions](s2_motion.png)

theta_1 is +-20.19 degrees for a stroke of 0.14 m, beta_2 0 to 6 degrees in swing, beta_3 90
degrees; legs (2, 3), (1, 6), (4, 5) swing in turn for a third of the 2.4 s each. The velocity of
theta_1 is 28 degrees/s on its plateau in stance and 56 degrees/s in swing.
`hp.motion.paper_motion(robot, stroke=0.14)`; `profile="step"` and `"constant"` are the other
readings, `ramp_share` is the *assumed* share of the ramps.
"""

MASS_CENTER = """
![Centre of mass](s2_mass_center.png)

Least margins and peak-to-peak excursions about the mean straight line over whole cycles, mm.
On arcs the robot sways because feet must slide sideways; on straight lines it does not. It surges
on all: swing legs carry their mass forward, and with ramps or a STEP in stance the groups of legs
move at different speeds.
"""

TORQUES = """
![Joint torques](s2_torques.png)

Peaks are those of integration steps, of the worst leg; total moments are peaks of means over 3.3
ms. The motor gives the axis torque; bearings and links carry the total moment. By axis torque joint
2 has to be sized; by total moment joint 1 is highest, 1.6 times joint 2: S2's figure 6 probably
shows total moments. The three peaks of the first row are computed a second time by equations
written apart from the core (`tests/test_second_rhs.py`): they agree within 0.1 %.

The reading of the motion decides the coxa's torque: legs that stand at different speeds push
against each other.
"""

RAMPS = """
The same motion by the share of each move in a ramp (*assumed*; 50 % leaves no plateau). Short ramps
accelerate the legs hard, long ones drive the groups of legs at different speeds. Peaks in N m:
"""

VERDICTS = """
Each peak is computed again at ten times the accuracy, with contact twice as stiff and servos twice
as stiff; it is confirmed where all stay within 5 % ([peaks](../uncertainty.md)).
"""

OUTPUT = """
S2 simulates 10 s in 600 output steps, one every 16.7 ms, and its peaks are those of the output.
Each cell gives the peak of every integration step, what S2's instants show of it, and the least
that such instants show when they begin up to 13.3 ms later; then the share that is missed by the
first and by the last. The cycle is 144 output steps long, so further cycles show nothing new.
"""

MOTORS = """
S2 takes the maximum torque as what a motor has to give. From the package's catalogue, the lightest
motor with that stall torque, beside the lightest that passes the [motor budget](../motors.md): peak
below the derated torque-speed line, RMS torque (heat) and rest below the continuous torque, and
speed. Numbers are need over what is permitted, of the worst joint; a motor carries the walk where
all are 1 or less. The robot keeps the mass of its file, and the motion is prescribed. Thermal
constants of these servos are not published, so heat is judged by the RMS torque; doubtful:
constants assumed by mass permit it at one end of their spread. Motors with uncertain numbers are
left out.
"""

FINDINGS = """
What the runs show beside S2's statements. S2 checks how torques vary with stroke and cycle time; it
does not, as known here, say that they grow or fall.
"""

FUTURE = """
S2 names the energy of gaits as future work. Roy and Pratihar (2012, the same group) find for
turning gaits that a low duty factor is cheaper at the highest speed that all gaits walk: a test of
sign, by three costs. Holding torque costs nothing mechanically, and fewer feet carry more each.
"""

SLOW = """
![Dynamic difference](s2_quasi_static.png)

Arcs at constant rate and ten times the cycle time, on feet with linear contact, which split the
load as least squares does. The figure shows the effect of speed, which is probably friction more
than inertia: the force of S2's law grows with the speed at which feet scrub.
"""

SWEEPS = """
![Torque against stroke and cycle time](s2_torque_peak.png)

![RMS torque by phase](s2_torque_rms.png)

![Torque maps](s2_torque_map.png)

S2's motion, velocity by STEPs, prescribed; 12 strokes by 12 cycle times (*assumed* ranges). At
ten times the accuracy peaks change by at most {peak} of their value, RMS by {rms}.
"""

ENERGY = """
![Energy against speed](s2_energy.png)

Five gaits at equal speed, stroke (0.14 m) and step height (20 mm) on straight lines, with servos on
three contacts (S2's, S1's and the package's accurate one) and prescribed on S2's; a blank cannot be
walked at the joints' speed limits. Which gait is cheapest depends on the cost: by mechanical work
it is the tripod at every speed, because its legs swing least often; by torque, which causes copper
losses without motion, gaits with many feet on the ground are cheaper as long as their joints are
fast enough. The contact decides the size of both costs, and moves them in opposite directions: the
mechanical one is largest on the accurate contact, the electrical one on S2's, whose friction lets
feet creep. The order of the gaits hardly changes. The copper loss is *assumed* from the URDF's
limits. Energy / (weight * distance) at 0.09 m/s [-], positive mechanical / electrical:
"""

MORE = """
Torques by phase and joint, p99, impulses, speeds and reasons of points that cannot be walked are
in the file: `hp.study.load_study("s2_study.nc")`, or `xarray.open_dataset(path, group="torque_map",
engine="h5netcdf")`. The tools are [hp.torque_map and hp.study.gait_energy](../sweeps.md),
[hp.stability and
hp.results.joint_moments](../stability.md), [hp.study.judge_peaks](../uncertainty.md).
"""
