"""Typed keys of the unknowns and the constraint rows of an NLP.

A table of a layout is identified by a member of :class:`Unknown` or :class:`Group`, or by such a member and the number
of a phase; a row of a table by its :class:`Key`, a column by its :class:`Place`.  Bounds, diagnosis and the transfer of
solutions use these keys; labels are printed and never compared.
"""

from enum import Enum, StrEnum
from typing import NamedTuple

from gaitopt.model.contacts.mode import Mode


class Unknown(StrEnum):
    """Tables of unknowns; the value is the name in files.  Tables of a phase are paired with its number."""

    ANGLES = "angles"
    RATES = "rates"
    TORQUE = "torque"
    DURATION = "duration"
    SLIDE = "slide"
    ACCELERATION = "acceleration"
    INNER_ACCELERATION = "inner acceleration"
    POWER = "power"
    INNER_POWER = "inner power"
    CONTACT = "contact"
    IMPULSE = "impulse"
    IMPULSE_BEFORE = "impulses before impact"
    IMPULSE_AFTER = "impulses after impact"
    OPEN_IMPACT = "open impact"
    TRAVEL = "travel"
    SLOPE = "slope"
    DESIGN = "design"
    INTEGRAL = "integral"
    PEAK = "peak"
    RELAXATION = "relaxation"
    COORDINATES = "coordinates"
    COORDINATE_RATES = "coordinate rates"
    PROJECTION = "projection"
    DEVIATION = "deviation"
    DEVIATION_RATE = "deviation of acceleration"
    INNER_DEVIATION_RATE = "inner deviation of acceleration"
    DEVIATION_OF_IMPULSE = "deviation of impulse"
    EVENT_SHIFT = "event shift"
    JERK = "jerk"
    RETURN = "return map"
    RADIUS = "spectral radius"
    GAIN = "gain"


class Group(StrEnum):
    """Tables of constraint rows; the value is the name in files.  Tables of a phase are paired with its number."""

    INTERVAL = "interval"
    END = "end"
    START = "start"
    LAST_POWER = "last power"
    CLEARANCE = "clearance"
    TOUCHDOWN = "touchdown"
    NOT_ARMED = "touchdown not armed"
    GUARD_ABOVE = "touchdown guard above zero"
    GUARD_BELOW = "touchdown guard below zero"
    INTEGRAL = "integral"
    PEAKS = "peaks"
    EVENT = "event"
    STEP = "step"
    DEVIATION_START = "deviation start"
    DEVIATION = "deviation"
    DEVIATION_END = "deviation end"
    DEVIATION_EVENT = "deviation event"
    DEVIATION_STEP = "deviation touchdown"
    RADIUS = "spectral radius"


TableKey = Unknown | Group | tuple[Unknown | Group, int]


def table_name(key: TableKey) -> str:
    """Return the name of a table in files.

    Examples
    --------
    >>> table_name((Unknown.SLIDE, 0)), table_name(Group.TOUCHDOWN)
    ('slide 0', 'touchdown')
    """
    return f"{key[0].value} {key[1]}" if isinstance(key, tuple) else key.value


class Kind(Enum):
    """Physical meaning of a row.

    Attributes
    ----------
    text : str
        Spelling, with ``{of}`` for the angle or the actuator.  Two kinds may have the same spelling.
    """

    text: str

    def __new__(cls, text: str) -> "Kind":
        """Return a member whose value is a number, so that two members may share a text."""
        member = object.__new__(cls)
        member._value_ = len(cls.__members__)
        member.text = text
        return member

    ANGLE = "{of}"
    RATE = "{of} rate"
    TORQUE = "{of} torque"
    DURATION = "duration"
    FOOT_SLIDE = "foot slide"
    SPEED_OF_FOOT = "foot speed"
    ACCELERATION = "acceleration of {of}"
    POSITIVE_POWER = "positive power of {of}"
    NEGATIVE_POWER = "negative power of {of}"
    IMPULSE = "{of} impulse"
    ACTUATOR_IMPULSE = "impulse of {of}"
    NEGATIVE_IMPULSE = "negative part of the impulse of {of}"
    POSITIVE_IMPULSE = "positive part of the impulse of {of}"
    SLIP_SPEED_AFTER_IMPACT = "slip speed after the impact"
    TRAVEL = "step length"
    SLOPE = "slope"
    DESIGN = "{of}"
    INTEGRAL = "integral of the objective"
    PEAK = "peak of {of}"
    DEVIATION = "deviation of {of}"
    JERK = "jerk of {of}"
    RADIUS = "spectral radius"
    GAIN = "gain of {of}"

    DYNAMICS = "dynamics of {of}"
    EQUATION_OF_MOTION = "equation of motion of {of}"
    TORQUE_RATE = "torque rate of {of}"
    POWER_SPLIT = "power split of {of}"
    NORMAL_FORCE = "normal force"
    FORWARD_CONE = "forward friction cone"
    BACKWARD_CONE = "backward friction cone"
    SLIP_DIRECTION = "foot speed"
    SLIP_ONSET = "slip onset on the cone"
    SLIDING_INERTIA = "well-posedness of slip"
    SLIP_FROM_REST = "sticking force outside the cone"
    CLEARANCE = "foot clearance"
    PEAK_BOUND = "bound of the peak, {of}"
    DEVIATION_EQUATION = "deviation equation {of}"
    RADIUS_CONDITION = "spectral radius, condition {of}"

    LEG_SWAP = "leg swap of {of}"
    MOMENTUM = "momentum balance {of}"
    IMPACT_CONE = "impact friction cone"
    FORWARD_IMPACT_CONE = "forward impact cone"
    BACKWARD_IMPACT_CONE = "backward impact cone"
    IMPULSE_PARTS = "parts of the tangential impulse"
    TOUCHDOWN = "touchdown"
    TOUCHDOWN_DIRECTION = "touchdown direction"
    TOUCHDOWN_AHEAD = "touchdown ahead of the stance foot"
    SEPARATION = "separation of the trailing foot"
    STEP_LENGTH = "step length"
    SPEED = "speed"
    STEP_DURATION = "step duration"
    NOT_ARMED = "touchdown not armed"
    GUARD_ABOVE = "touchdown guard above zero"
    GUARD_BELOW = "touchdown guard below zero"

    CONTACT_NORMAL = "normal force"
    CONTACT_FRICTION = "{of} friction"
    SLIP_SPEED = "slip speed"
    CONTACT_FORCE = "force of {of}"
    CONTACT_POSITION = "position of {of}"
    CONTACT_RATE = "rate of {of}"
    JOINT_ACCELERATION = "acceleration of joint coordinate {of}"
    JOINT_FORCE = "force of joint coordinate {of}"
    JOINT_JUMP = "rate jump of joint coordinate {of}"
    JOINT_IMPULSE = "impulse of joint coordinate {of}"
    POSITION_PROJECTION = "position projection of {of}"
    RATE_PROJECTION = "rate projection of {of}"
    GAP = "gap of {of}"
    CONE_FORWARD = "forward friction cone of {of}"
    CONE_BACKWARD = "backward friction cone of {of}"
    IMPACT_CONE_FORWARD = "forward impact cone of {of}"
    IMPACT_CONE_BACKWARD = "backward impact cone of {of}"
    LIFT_OFF_FORWARD = "forward friction cone of {of} at lift-off"
    LIFT_OFF_BACKWARD = "backward friction cone of {of} at lift-off"
    SLIP_SPEED_OF = "slip speed of {of}"
    ONSET = "slip onset of {of} on the cone"
    REST = "rest of {of}"
    CLOSING = "touchdown of {of}"
    APPROACH = "approach speed of {of}"
    ARMED = "armed {of}"
    SEPARATION_OF = "separation of {of}"
    PERIODICITY = "periodicity of {of}"
    HEIGHT = "height of {of}"
    PAIR = "{of}"
    RELAXATION = "{of}"
    SLACK = "{of}"
    CUSTOM = "{of}"


class Key(NamedTuple):
    """Physical meaning of one row of a table.

    Attributes
    ----------
    kind : Kind
    of : str
        The angle, the actuator or another name the quantity belongs to.
    inner : int
        Inner point of an interval, counted from 1; 0 at a node.

    Examples
    --------
    >>> key = Key(Kind.POWER_SPLIT, "hip")
    >>> key.label, key.at(2).label
    ('power split of hip', 'power split of hip, inner point 2')
    """

    kind: Kind
    of: str = ""
    inner: int = 0

    def at(self, inner: int) -> "Key":
        """Return the key of the same quantity at an inner point of an interval; 0 is the node."""
        return Key(self.kind, self.of, inner)

    @property
    def identifier(self) -> str:
        """Text of the key in files, independent of the printed label."""
        text = self.kind.text.replace("{of}", self.of)
        return f"{text}, inner point {self.inner}" if self.inner else text

    @property
    def label(self) -> str:
        """Text printed by the diagnosis."""
        return label(self, self.identifier)


def label(key: Key, identifier: str) -> str:
    """Return the text printed by the diagnosis of a key, whose text in files is known.

    Examples
    --------
    >>> label(key := Key(Kind.REST, "foot"), key.identifier)
    'coming to rest of foot'
    """
    return f"coming to {identifier}" if key.kind is Kind.REST else identifier


class Row(NamedTuple):
    """A constraint row: its key and its bounds."""

    key: Key
    lower: float
    upper: float


def equation(kind: Kind, of: str = "") -> Row:
    """Return a row whose value must vanish."""
    return Row(Key(kind, of), 0.0, 0.0)


class StepPart(Enum):
    """Parts of a step; the value is the printed label except for a phase."""

    PHASE = "phase"
    TOUCHDOWN = "touchdown"
    STEP = "step"
    GROUND = "ground"
    DESIGN = "design"


class Place(NamedTuple):
    """Place along the step that a column of a table belongs to.

    Attributes
    ----------
    part : StepPart
    phase : int or None
        Number of the phase, from 0.
    mode : Mode or None
        Contact mode of the phase.
    node : int or None
        Counted from the start of the phase.
    between : bool
        Whether the place is the interval after the node.
    contacts : str
        Modes of the closed contacts of the phase, for a robot with several contacts.

    Examples
    --------
    >>> Place(StepPart.PHASE, 1, Mode.STICK, 3).label
    'phase 2 (stick), node 3'
    """

    part: StepPart
    phase: int | None = None
    mode: Mode | None = None
    node: int | None = None
    between: bool = False
    contacts: str = ""

    @property
    def label(self) -> str:
        """Text printed by the diagnosis."""
        state = self.contacts if self.mode is None else self.mode.value
        if self.phase is None or not state:
            return self.part.value
        text = f"phase {self.phase + 1} ({state})"
        if self.node is None:
            return text
        return f"{text}, between nodes {self.node} and {self.node + 1}" if self.between else f"{text}, node {self.node}"


TOUCHDOWN, STEP = Place(StepPart.TOUCHDOWN), Place(StepPart.STEP)
GROUND, DESIGN = Place(StepPart.GROUND), Place(StepPart.DESIGN)
