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

S2 prints no torque numbers, and its motion leaves open whether coxae turn in stance at a
constant rate or in one STEP: both are run. Hip positions, foot radius and the position of 0.631 kg
are *assumed* ([urdf/README.md](../../urdf/README.md)). Lengths in mm, torques in N m.
"""

CLAIMS = """
The paper's statements, paraphrased from its abstract and figures, each with our number.
"""

MOTION = """
![Joint motions](s2_motion.png)

theta_1 is +-20.19 degrees for a stroke of 0.14 m, beta_2 0 to 6 degrees in swing, beta_3 90
degrees; legs (2, 3), (1, 6), (4, 5) swing in turn for a third of the 2.4 s each.
`hp.motion.paper_motion(robot, stroke=0.14)`.
"""

MASS_CENTER = """
![Centre of mass](s2_mass_center.png)

Least margins and peak-to-peak excursions about the mean straight line over whole cycles, mm.
On arcs the robot sways because feet must slide sideways; on straight lines it does not. It surges
on all: swing legs carry their mass forward, and with a STEP in stance the groups of legs move at
different speeds.
"""

TORQUES = """
![Joint torques](s2_torques.png)

Peaks are those of integration steps, of the worst leg; total moments are peaks of means over 3.3
ms. The motor gives the axis torque; bearings and links carry the total moment. By axis torque joint
2 has to be sized; by total moment joint 1 is highest, 1.6 times joint 2: S2's figure 6 probably
shows total moments.
"""

VERDICTS = """
Each peak is computed again at ten times the accuracy, with contact twice as stiff and servos twice
as stiff; it is confirmed where all stay within 5 % ([peaks](../uncertainty.md)).
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

S2's motion, STEP in stance, prescribed; 12 strokes by 12 cycle times (*assumed* ranges). At
ten times the accuracy peaks change by at most {peak} of their value, RMS by {rms}.
"""

ENERGY = """
![Energy against speed](s2_energy.png)

Five gaits at equal speed, stroke (0.14 m) and step height (20 mm) on straight lines, with servos
and prescribed; a blank cannot be walked at the joints' speed limits. The cheapest gait depends on
the cost: by mechanical work it is the tripod at every speed, because its legs swing least often;
by torque, which causes copper losses without motion, gaits with many feet on the ground are
cheaper as long as their joints are fast enough. The copper loss is *assumed* from the URDF's
limits.
"""

MORE = """
Torques by phase and joint, p99, impulses, speeds and reasons of points that cannot be walked are
in the file: `hp.study.load_study("s2_study.nc")`, or `xarray.open_dataset(path, group="torque_map",
engine="h5netcdf")`. The tools are [hp.torque_map and hp.study.gait_energy](../sweeps.md),
[hp.stability
and hp.results.joint_moments](../stability.md), [hp.study.judge_peaks](../uncertainty.md).
"""
