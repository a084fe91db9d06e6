"""Optimal hop of a monopod that is imported from MJCF and reduced to the sagittal plane.

The robot is that of monopod.py; the angle of the leg is relative to the body.  The script requires ``pip install
'gaitopt[import]'``.  Solve it with ``gaitopt solve problems/imported_mjcf.py``.  The import also accepts the path of a
file.
"""

import functools

import monopod

from gaitopt import Collocation, Margins
from gaitopt.model import import_planar
from gaitopt.ocp import PlanarKeyframes, PlanarLimits, PlanarProblem

MJCF = """<mujoco model="monopod">
  <worldbody>
    <body name="body" pos="0 0 0.6">
      <freejoint/>
      <inertial pos="0 0 0" mass="8" diaginertia="0.4 0.4 0.4"/>
      <body name="leg">
        <joint name="hip" type="hinge" axis="0 -1 0"/>
        <body name="foot">
          <joint name="leg" type="slide" axis="0 0 -1" stiffness="3000" springref="0.6"/>
          <inertial pos="0 0 0" mass="1" diaginertia="1e-9 1e-9 1e-9"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="hip"/><motor joint="leg"/></actuator>
</mujoco>"""


@functools.cache
def hopper():
    """Return the imported monopod, with the list of the parts of the file that are omitted."""
    return import_planar(MJCF, contacts={"sole": ("foot", (0, 0, 0))})


def hop_guess(stride, period):
    """Return a hop whose leg swings back in stance and forward in flight."""
    part = (0, 0.1, 0.2, 0.6, 1)  # of the period
    coordinates = {
        "x": [stride * each for each in part],
        "y": (0.5, 0.48, 0.52, 0.64, 0.5),
        "pitch": (0, 0, 0, 0, 0),
        "hip": (0.1, 0, -0.1, 0, 0.1),
        "leg": (0.5, 0.48, 0.53, 0.59, 0.5),
    }
    return PlanarKeyframes([period * each for each in part], coordinates, phases=(0.2 * period, 0.8 * period))


def problem(
    sequence="sole stick > flight |",
    friction=1.0,  # Coulomb coefficient
    speed=1.5,  # [m/s]
    step_length=0.6,  # [m]
    foot_mass=1.0,  # [kg]
    clearance=2e-3,  # least height of the foot in flight [m]
    stance_intervals=8,  # grid intervals of the phase with the foot on the ground
    flight_intervals=24,  # grid intervals of the flight
):
    """Return the problem of a hop."""
    return PlanarProblem(
        name="imported monopod",
        robot=hopper().robot,
        sequence=sequence,
        parameters={"foot_mass": foot_mass},
        friction=friction,
        speed=speed,
        step_length=step_length,
        objective=monopod.HopEffort(),
        limits=PlanarLimits(coordinate={"leg": (0.35, 0.65), "pitch": monopod.PITCH}, clearance=clearance),
        margins=Margins(touchdown_rate=0.1, slip_speed=0, normal_force=0),
        guess=hop_guess(step_length, step_length / speed),
        transcription=Collocation(intervals=(stance_intervals, flight_intervals)),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    for line in hopper().dropped:
        print(line)
    run_script(__file__)
