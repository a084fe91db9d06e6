"""Public names of a package, imported when first used.

The names are listed once, in the package's stub ``__init__.pyi``, as ``from module import Name as Name``.  Type
checkers and editors read the stub; at run time :func:`export_lazily` reads the same file, so that importing a package
imports nothing else.  This module imports only what Python has loaded at its start: a command can handle Ctrl-C once
this package is imported.
"""

import sys
from importlib import import_module
from types import ModuleType


class LazyPackage(ModuleType):
    """A package whose public names are imported from their modules when first used.

    A name that is also the name of its module, such as ``gaitopt.study.sweeps.sweep``, is the public object, never the
    module.
    """

    _modules: dict[str, str]

    def __getattr__(self, name: str) -> object:
        if name not in self._modules:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        value = getattr(import_module(self._modules[name]), name)
        vars(self)[name] = value
        return value

    def __setattr__(self, name: str, value: object) -> None:
        # Python stores a module in its package once the module is imported.
        if isinstance(value, ModuleType) and name in self._modules:
            if value.__name__ != self._modules[name]:
                return  # a subpackage of the same name: the public object is imported when first used
            value = getattr(value, name)
        super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        # Modules that Python has stored here and names that this package uses are no public names.
        return sorted(self._modules)


def export_lazily(package: str) -> None:
    """Give an imported package the public names of its stub.

    Parameters
    ----------
    package : str
        ``__name__`` of the package.

    Examples
    --------
    >>> import gaitopt.motion
    >>> exported_names("gaitopt.motion")["Gait"], gaitopt.motion.Gait.__name__
    ('gaitopt.motion.gait', 'Gait')
    """
    module, modules = sys.modules[package], _read_stub(package)
    vars(module).update(_modules=modules, __all__=sorted(_omit_private_names(modules)))
    module.__class__ = LazyPackage


def exported_names(package: str) -> dict[str, str]:
    """Return the public names of a package in the order of its stub, and the module that defines each.

    Parameters
    ----------
    package : str
        Name of a package that has a stub.

    Examples
    --------
    >>> exported_names("gaitopt.continuation")["trace"]
    'gaitopt.continuation.tracing'
    """
    return _omit_private_names(_read_stub(package))


def _omit_private_names(modules: dict[str, str]) -> dict[str, str]:
    return {name: module for name, module in modules.items() if not name.startswith("_")}


def _read_stub(package: str) -> dict[str, str]:
    """Return the names that the stub of a package imports, such as ``__version__``, and their modules."""
    with open(f"{import_module(package).__file__}i", encoding="utf-8") as stub:  # noqa: PTH123 pathlib is not imported
        lines = [line.split() for line in stub]
    # An entry is "from MODULE import NAME as NAME".  To parse the stubs as Python would take longer.
    entries = [words for words in lines if len(words) == 6 and words[::2] == ["from", "import", "as"]]
    return {name: module for _, module, _, name, _, exported in entries if exported == name}
