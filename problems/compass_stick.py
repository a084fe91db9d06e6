"""Energy-optimal compass-biped gait that never slips, for comparison with compass_slip.py.

The same problem and parameters with another contact sequence.  Run it with ``gaitopt solve problems/compass_stick.py``.
"""

import functools

import compass_slip

problem = functools.partial(compass_slip.problem, sequence="stick | stick")


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
