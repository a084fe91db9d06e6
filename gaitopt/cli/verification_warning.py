"""Warning of commands whose gait is not verified."""

import shlex
from pathlib import Path
from typing import Any

from gaitopt.cli.output import err


def warn_about_verification(gait: Any, file: Path, *, hidden: bool, name: str = "") -> bool:
    """Return whether a gait is verified; otherwise print a warning with the command that replays it.

    Parameters
    ----------
    gait : Gait, PlanarGait or MultiStepGait
    file : Path
        File of the gait, or the script of its problem.
    hidden : bool
        Whether nothing is printed.
    name : str
        Name of the gait, if the command has several ones.
    """
    from gaitopt.motion.verification_remark import remark_on_verification

    remark = remark_on_verification(gait)
    if remark and not hidden:
        words = ["gaitopt", "verify", str(file), "-o", f"{file.stem}_verified.h5"]
        command = shlex.join(["gaitopt", "solve", str(file)] if file.suffix == ".py" else words)
        replay = f" To replay them: {command}" if gait.status.ok and gait.verification is None else ""
        err.print(f"warning: {name and f'{name}: '}{remark}{replay}", soft_wrap=True, markup=False)
    return not remark
