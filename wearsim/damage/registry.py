"""Registries of the damage laws: every record at the top of a module of a folder is registered."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable
from typing import Any, TypeVar

from wearsim.errors import Fault, SceneError, suggestion

Record = TypeVar("Record")


class Registry(dict[str, Record]):
    """Records by name; looking up an unknown name raises a `SceneError` that lists the known ones.

    Parameters
    ----------
    kind : str
        What a record is called in messages, such as "wear law".
    records : iterable of records
        Each with its own `name`.
    """

    def __init__(self, kind: str, records: Iterable[Any]) -> None:
        self.kind = kind
        super().__init__()
        for record in records:
            if self.setdefault(record.name, record) is not record:
                raise ValueError(f'{kind} "{record.name}" is defined twice')

    def __missing__(self, name: str) -> Record:
        raise SceneError([unknown(self.kind, name, self)])


def discover(kind: str, package: str, path: Iterable[str], record: type[Record]) -> Registry[Record]:
    """Collect every `record` at the top of a module of a package, modules in alphabetical order.

    Parameters
    ----------
    kind : str
        What a record is called in messages.
    package, path : str and iterable of str
        Name and `__path__` of the package.
    record : type
        Class of the records.
    """
    names = sorted(module.name for module in pkgutil.iter_modules(path))
    modules = [importlib.import_module(f"{package}.{name}") for name in names]
    return Registry(
        kind, (value for module in modules for value in vars(module).values() if isinstance(value, record))
    )


def unknown(kind: str, name: str, known: Iterable[str]) -> Fault:
    """Return the fault of an unknown name, with the known ones and the one that is similar."""
    names = sorted(known)
    return Fault(f'{kind} "{name}" is unknown; there is {", ".join(names)}{suggestion(name, names)}')
