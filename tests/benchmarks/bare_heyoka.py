"""One step of the passive compass as a plain heyoka script, the way one writes it by hand for this one robot.

Everything is typed in: equations of motion, contact forces, impact, leg swap, contact rules; numbers are baked into the
compiled code.  The events are those gaitopt watches.  Nothing of gaitopt is used, so it is also an independent check.
"""

import math

import heyoka as hy

LENGTH, COM, LEG, HIP, GRAVITY, SLOPE = 1.6, 0.8, 4.0, 2.0, 9.8, math.radians(1)
SHORT = LENGTH - COM
FIRST, SECOND = LEG * COM + (HIP + LEG) * LENGTH, LEG * SHORT  # first moments of what swings with each leg
COUPLING = LEG * LENGTH * SHORT
M11, M22 = LEG * COM**2 + (HIP + LEG) * LENGTH**2, LEG * SHORT**2
MASS = 2 * LEG + HIP
DOWNHILL, INTO = GRAVITY * math.sin(SLOPE), GRAVITY * math.cos(SLOPE)


def compile_mode(sign, mu, compact_mode):
    """Return the integrator of a mode, +1 and -1 for slip, 0 for stick, and the names of its events."""
    x, th1, th2, vx, w1, w2 = hy.make_vars("x", "th1", "th2", "vx", "w1", "w2")
    s1, c1, s2, c2 = hy.sin(th1), hy.cos(th1), hy.sin(th2), hy.cos(th2)
    m12, turn = COUPLING * hy.cos(th1 + th2), COUPLING * hy.sin(th1 + th2)
    n1, n2 = w1 * w1, w2 * w2
    h1 = -turn * n2 - FIRST * (DOWNHILL * c1 + INTO * s1)
    h2 = -turn * n1 - SECOND * (DOWNHILL * c2 - INTO * s2)
    hx = -FIRST * s1 * n1 - SECOND * s2 * n2 - MASS * DOWNHILL
    hy_ = -FIRST * c1 * n1 + SECOND * c2 * n2 + MASS * INTO
    if sign == 0:
        one = 1.0 / (M11 * M22 - m12 * m12)
        a1, a2 = (m12 * h2 - M22 * h1) * one, (m12 * h1 - M11 * h2) * one
        tangential = FIRST * c1 * a1 + SECOND * c2 * a2 + hx
        normal = -FIRST * s1 * a1 + SECOND * s2 * a2 + hy_
        system = [(th1, w1), (th2, w2), (w1, a1), (w2, a2)]
        events = {"lift-off": normal, "slip+": normal + tangential / mu, "slip-": normal - tangential / mu}
    else:
        slide = sign * mu
        r1, r2, load = FIRST * (c1 - slide * s1), SECOND * (c2 + slide * s2), -(hx + slide * hy_)
        p1, p2 = FIRST / MASS * c1, SECOND / MASS * c2
        k11, k12, k21, k22 = M11 - p1 * r1, m12 - p1 * r2, m12 - p2 * r1, M22 - p2 * r2
        q1, q2, determinant = -h1 - p1 * load, -h2 - p2 * load, k11 * k22 - k12 * k21
        one = 1.0 / determinant
        a1, a2 = (q1 * k22 - k12 * q2) * one, (k11 * q2 - k21 * q1) * one
        system = [(x, vx), (th1, w1), (th2, w2), (vx, (load - r1 * a1 - r2 * a2) / MASS), (w1, a1), (w2, a2)]
        normal = -FIRST * s1 * a1 + SECOND * s2 * a2 + hy_
        # A sliding foot may start at rest: the tiny speed keeps that from being an event.
        events = {"at rest": sign * vx + 1e-16, "lift-off": normal, "painleve": determinant}
    # The start of a step is a touchdown too; the tiny angle keeps it from being an event.
    events |= {"touchdown": th2 - th1 - 1e-13, "fall": c1}
    falling = [hy.t_event(event, direction=hy.event_direction.negative) for event in events.values()]
    start = [0.0] * len(system)
    integrator = hy.taylor_adaptive(system, start, tol=1e-15, compact_mode=compact_mode, t_events=falling)
    return integrator, integrator.state, tuple(events)


class BareCompass:
    """Steps of the passive compass on a slope of one degree."""

    def __init__(self, mu, *, compact_mode=True):
        self.mu, self.modes = mu, {sign: compile_mode(sign, mu, compact_mode) for sign in (0, 1, -1)}

    def walk_step(self, state):
        """Walk from (x, th1, th2, vx, w1, w2); return the next such state and the modes of this step."""
        y, clock, signs = list(state), 0.0, []
        sign = self._sign_at_rest(y) if y[3] == 0 else 1 if y[3] > 0 else -1
        for _ in range(50):
            signs.append(sign)
            integrator, values, names = self.modes[sign]
            values[:] = y if sign else (y[1], y[2], y[4], y[5])
            integrator.time = clock
            integrator.reset_cooldowns()
            while True:
                code = int(integrator.propagate_until(10.0)[0])
                if not -len(names) <= code < 0:
                    raise RuntimeError("no touchdown")
                event = names[~code]
                if event != "touchdown" or values[1 if sign else 0] > 0:
                    break
            clock, last = integrator.time, values.tolist()
            y = last if sign else [y[0], *last[:2], 0.0, *last[2:]]
            if event == "touchdown":
                return self._impact(y), signs
            if event not in ("at rest", "slip+", "slip-"):
                raise RuntimeError(event)
            y[3] = 0.0
            sign = self._sign_at_rest(y) if event == "at rest" else 1 if event == "slip+" else -1
        raise RuntimeError("chattering")

    def walk(self, state, steps):
        """Walk some steps; return how many were tried, the last state after one, and why it ended early or None."""
        for step in range(steps):
            try:
                state, _ = self.walk_step(state)
            except RuntimeError as stop:
                return step + 1, state, str(stop)
        return steps, state, None

    def _sign_at_rest(self, y):
        _, th1, th2, _, w1, w2 = y
        s1, c1, s2, c2 = math.sin(th1), math.cos(th1), math.sin(th2), math.cos(th2)
        m12, turn = COUPLING * math.cos(th1 + th2), COUPLING * math.sin(th1 + th2)
        h1 = -turn * w2 * w2 - FIRST * (DOWNHILL * c1 + INTO * s1)
        h2 = -turn * w1 * w1 - SECOND * (DOWNHILL * c2 - INTO * s2)
        one = 1 / (M11 * M22 - m12 * m12)
        a1, a2 = (m12 * h2 - M22 * h1) * one, (m12 * h1 - M11 * h2) * one
        tangential = FIRST * (c1 * a1 - s1 * w1 * w1) + SECOND * (c2 * a2 - s2 * w2 * w2) - MASS * DOWNHILL
        normal = -FIRST * (s1 * a1 + c1 * w1 * w1) + SECOND * (s2 * a2 + c2 * w2 * w2) + MASS * INTO
        return 0 if abs(tangential) <= self.mu * normal else 1 if tangential < 0 else -1

    def _impact(self, y):
        """Return the state after the impact and the leg swap; which foot rests is found by trying."""
        x, th1, th2, vx, w1, w2 = y
        s1, c1, s2, c2 = math.sin(th1), math.cos(th1), math.sin(th2), math.cos(th2)
        v_t, v_n = vx + LENGTH * (c1 * w1 + c2 * w2), LENGTH * (s2 * w2 - s1 * w1)
        mobility, rates = self._rates_per_impulse(s1, c1, s2, c2)
        (t_t, t_n), (_, n_n) = mobility
        determinant = t_t * n_n - t_n * t_n
        l_t, l_n = (t_n * v_n - n_n * v_t) / determinant, (t_n * v_t - t_t * v_n) / determinant
        if not (l_n >= 0 and abs(l_t) <= self.mu * l_n):
            for sign in (1, -1):
                l_n = -v_n / (n_n - sign * self.mu * t_n)
                l_t = -sign * self.mu * l_n
                if l_n >= 0 and sign * (v_t + mobility[0][0] * l_t + t_n * l_n) > 0:
                    break
            else:
                raise RuntimeError("no impact")
            slides = True
        else:
            slides = False
        (x_t, x_n), (y_t, y_n), (a_t, a_n), (b_t, b_n) = rates
        if y_t * l_t + y_n * l_n < 0:
            raise RuntimeError("double support")
        vx, w1, w2 = vx + x_t * l_t + x_n * l_n, w1 + a_t * l_t + a_n * l_n, w2 + b_t * l_t + b_n * l_n
        foot = vx + LENGTH * (c1 * w1 + c2 * w2) if slides else 0.0
        return [x + LENGTH * (s1 + s2), -th2, -th1, foot, -w2, -w1]

    def _rates_per_impulse(self, s1, c1, s2, c2):
        """Return the landing foot's mobility, and the rates (x, y, th1, th2) per unit impulse, columns (t, n)."""
        m12 = COUPLING * (c1 * c2 - s1 * s2)
        # The old foot is free: eliminate its velocity, of which the mass matrix is MASS times one.
        fx1, fx2, fy1, fy2 = FIRST * c1, SECOND * c2, -FIRST * s1, SECOND * s2
        k11 = M11 - (fx1 * fx1 + fy1 * fy1) / MASS
        k12 = m12 - (fx1 * fx2 + fy1 * fy2) / MASS
        k22 = M22 - (fx2 * fx2 + fy2 * fy2) / MASS
        one = 1 / (k11 * k22 - k12 * k12)
        columns = []
        for unit_t, unit_n in ((1.0, 0.0), (0.0, 1.0)):
            g1 = LENGTH * (c1 * unit_t - s1 * unit_n) - (fx1 * unit_t + fy1 * unit_n) / MASS
            g2 = LENGTH * (c2 * unit_t + s2 * unit_n) - (fx2 * unit_t + fy2 * unit_n) / MASS
            a, b = (k22 * g1 - k12 * g2) * one, (k11 * g2 - k12 * g1) * one
            fx, fy = (unit_t - fx1 * a - fx2 * b) / MASS, (unit_n - fy1 * a - fy2 * b) / MASS
            columns.append((fx, fy, a, b))
        feet = [(fx + LENGTH * (c1 * a + c2 * b), fy + LENGTH * (s2 * b - s1 * a)) for fx, fy, a, b in columns]
        mobility = ((feet[0][0], feet[1][0]), (feet[0][1], feet[1][1]))
        return mobility, [(columns[0][i], columns[1][i]) for i in range(4)]
