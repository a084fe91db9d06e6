"""Design: gaits and laws that hold over families of problems and over scenarios that differ from the plan."""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
