"""Registries of models and laws: every record at the top of a module of a folder; the limits of grids."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from wearsim.errors import ContactError, Fault, SceneError, suggestion

Record = TypeVar("Record")


class Registry(dict[str, Record]):
    """Records by name; looking up an unknown name raises a `SceneError` that lists the known ones.

    Parameters
    ----------
    kind : str
        What a record is called in messages, such as "wear law".
    records : iterable of records
        Each with its own `name`.
    removed : mapping, optional
        Names of earlier versions, with what a message says after the name.
    """

    def __init__(self, kind: str, records: Iterable[Any], removed: Mapping[str, str] | None = None) -> None:
        self.kind = kind
        self.removed = dict(removed or {})
        super().__init__()
        for record in records:
            if self.setdefault(record.name, record) is not record:
                raise ValueError(f'{kind} "{record.name}" is defined twice')

    def __missing__(self, name: str) -> Record:
        if name in self.removed:
            raise SceneError([Fault(f'{self.kind} "{name}" {self.removed[name]}')])
        raise SceneError([unknown(self.kind, name, self)])

    def that_take(self, parameter: str) -> str:
        """Return the names of the records that take a parameter, as messages write them."""
        takers = (name for name, record in self.items() if parameter in getattr(record, "parameters", ()))
        return " or ".join(f'"{name}"' for name in takers)


def discover(
    kind: str,
    package: str,
    path: Iterable[str],
    record: type[Record],
    removed: Mapping[str, str] | None = None,
) -> Registry[Record]:
    """Collect every `record` at the top of a module of a package, modules in alphabetical order.

    Parameters
    ----------
    kind : str
        What a record is called in messages.
    package, path : str and iterable of str
        Name and `__path__` of the package.
    record : type
        Class of the records.
    removed : mapping, optional
        As of `Registry`.
    """
    names = sorted(module.name for module in pkgutil.iter_modules(path))
    modules = [importlib.import_module(f"{package}.{name}") for name in names]
    records = (value for module in modules for value in vars(module).values() if isinstance(value, record))
    return Registry(kind, records, removed)


def unknown(kind: str, name: str, known: Iterable[str]) -> Fault:
    """Return the fault of an unknown name, with the known ones and the one that is similar."""
    names = sorted(known)
    return Fault(f'{kind} "{name}" is unknown; there is {", ".join(names)}{suggestion(str(name), names)}')


def check_grid(
    name: str, strips: int, cells: int, fewest: int, most_strips: int | None, hint: str = ""
) -> None:
    """Compare a grid with the limits of a model.

    Parameters
    ----------
    name : str
        Of the model.
    strips, cells : int
        Strips across a patch and cells along each.
    fewest : int
        Strips, and cells along each, at least.
    most_strips : int or None
        Strips at most.
    hint : str
        What else could be done about a coarse grid.

    Raises
    ------
    ContactError
        Without a row: a fault of no operating point.
    """
    if min(strips, cells) < fewest:
        raise ContactError(f"{name} needs at least {fewest} strips and cells along them; take more{hint}")
    if most_strips is not None and strips > most_strips:
        raise ContactError(f"{name} has room for {most_strips} strips at most; take fewer")
