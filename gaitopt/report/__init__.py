"""Reports: gaits as one self-contained page, and their display in notebooks.

:func:`write_report` writes an HTML page with charts and a player that needs neither network nor server.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
