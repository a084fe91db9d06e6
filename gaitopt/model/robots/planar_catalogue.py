"""The built-in robots with any contacts, by name."""

from collections.abc import Callable

from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robots.compass_with_torso import compass_with_torso
from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
from gaitopt.model.robots.flat_foot_walker import flat_foot_walker
from gaitopt.model.robots.kneed_walker import kneed_walker
from gaitopt.model.robots.monopod import monopod
from gaitopt.model.robots.quadruped import quadruped
from gaitopt.model.robots.round_foot_walker import round_foot_walker
from gaitopt.model.robots.telescoping_biped import telescoping_biped
from gaitopt.model.robots.vertical_hopper import vertical_hopper

PLANAR_CATALOGUE: dict[str, Callable[[], PlanarRobot]] = {
    "compass_with_torso": compass_with_torso,
    "compass_with_two_feet": compass_with_two_feet,
    "flat_foot_walker": flat_foot_walker,
    "kneed_walker": kneed_walker,
    "monopod": monopod,
    "quadruped": quadruped,
    "round_foot_walker": round_foot_walker,
    "telescoping_biped": telescoping_biped,
    "vertical_hopper": vertical_hopper,
}
