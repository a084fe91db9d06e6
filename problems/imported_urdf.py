"""Optimal gait of a five-link walker that is imported from URDF and reduced to the sagittal plane.

The script requires ``pip install 'gaitopt[import]'``.  Solve it with ``gaitopt solve problems/imported_urdf.py``.  The
import reports what it omits, here the roll joints and the distance between the hips.  It also accepts the path of a
file.
"""

import functools

from gaitopt import Collocation, Margins
from gaitopt.model import import_planar
from gaitopt.ocp import PlanarLimits, PlanarProblem

LEG = """
  <link name="{side}_pelvis"/>
  <joint name="{side}_roll" type="revolute">
    <parent link="torso"/><child link="{side}_pelvis"/><origin xyz="0 {lateral} 0"/><axis xyz="1 0 0"/>
    <limit lower="-0.5" upper="0.5" effort="50" velocity="10"/>
  </joint>
  <link name="{side}_thigh"><inertial><origin xyz="0 0 -0.11"/><mass value="6.8"/>
    <inertia ixx="0.47" iyy="0.47" izz="0.09" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="{side}_hip" type="continuous">
    <parent link="{side}_pelvis"/><child link="{side}_thigh"/><axis xyz="0 -1 0"/>
  </joint>
  <link name="{side}_shank"><inertial><origin xyz="0 0 -0.24"/><mass value="3.2"/>
    <inertia ixx="0.2" iyy="0.2" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="{side}_knee" type="continuous">
    <parent link="{side}_thigh"/><child link="{side}_shank"/><origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/>
  </joint>"""
URDF = f"""<robot name="five_link">
  <link name="torso"><inertial><origin xyz="0 0 0.24"/><mass value="12"/>
    <inertia ixx="1.33" iyy="1.33" izz="0.27" ixy="0" ixz="0" iyz="0"/></inertial></link>
  {LEG.format(side="left", lateral=0.1)}{LEG.format(side="right", lateral=-0.1)}
</robot>"""


@functools.cache
def walker():
    """Return the imported walker, with the list of the parts of the file that are omitted."""
    return import_planar(
        URDF,
        contacts={f"{side} foot": (f"{side}_shank", (0, 0, -0.4)) for side in ("left", "right")},
        mirror={"left_hip": "right_hip", "left_knee": "right_knee", "left foot": "right foot"},
    )


def problem(
    sequence="left foot stick |",
    friction=0.6,  # Coulomb coefficient
    speed=0.7,  # [m/s]
    step_length=0.4,  # [m]
    torso_mass=12.0,  # [kg]
    approach=0.05,  # least normal speed of the foot when it lands [m/s]
    intervals=12,  # grid intervals of the step
):
    """Return the problem of a step."""
    hip, knee = (-1, 1.2), (0.02, 2)
    return PlanarProblem(
        name="imported five-link walker",
        robot=walker().robot,
        sequence=sequence,
        parameters={"torso_mass": torso_mass},
        friction=friction,
        speed=speed,
        step_length=step_length,
        objective="torque_squared",
        limits=PlanarLimits(
            coordinate={"pitch": (-1, 1), "left_hip": hip, "right_hip": hip, "left_knee": knee, "right_knee": knee},
            clearance=0,
        ),
        margins=Margins(touchdown_rate=approach),
        transcription=Collocation(intervals=intervals),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    for line in walker().dropped:
        print(line)
    run_script(__file__)
