"""gaitopt: optimal-control gait design for planar walking with foot slippage.

The names that are used most are listed in ``__init__.pyi`` and imported at their first use, so that importing gaitopt
is quick; each sub-package, such as ``gaitopt.motion``, lists all its public names in the same way.
"""

import sys

from gaitopt.ipython import load_ipython_extension
from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)

if "IPython" in sys.modules and (_shell := sys.modules["IPython"].get_ipython()) is not None:
    load_ipython_extension(_shell)
