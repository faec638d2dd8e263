"""Registries of models and laws: shipped records, plug-ins and scripts; grid limits."""

from __future__ import annotations

import functools
import importlib
import pkgutil
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any, Generic, TypeVar

from wearsim.errors import (
    ContactError,
    Fault,
    PluginError,
    SceneError,
    WearsimError,
    brief,
    suggestion,
)

Record = TypeVar("Record")


class Registry(MutableMapping[str, Record], Generic[Record]):
    """Records by name.

    An unknown name raises a `SceneError` that lists the known names. Records of
    installed packages are added when a name that is not shipped, or all names, are
    requested.

    Parameters
    ----------
    kind : str
        Noun for a record in messages, such as "wear law".
    records : iterable of records
        Each with its own `name`.
    unusable : mapping, optional
        Names of earlier versions, with the text that follows the name in messages;
        those of plug-ins that cannot be used are added.
    group : str
        Entry points whose objects are records; "": none.
    record : type
        Class of the records.
    function, returns : str and type
        Field of a record that holds its function, and what that returns; "": none.
    """

    def __init__(
        self,
        kind: str,
        records: Iterable[Any],
        unusable: Mapping[str, str] | None = None,
        *,
        group: str = "",
        record: type = object,
        function: str = "",
        returns: type = object,
    ) -> None:
        self.kind, self.group = kind, group
        self.unusable = dict(unusable or {})
        self._class: Any = record
        self._function, self._returns = function, returns
        self._records: dict[str, Record] = {}
        self._sources: dict[str, str] = {}  # sources of records that are not shipped
        self._searched = not group
        for entry in records:
            if self._records.setdefault(entry.name, entry) is not entry:
                raise ValueError(f'{kind} "{entry.name}" is defined twice')

    def __getitem__(self, name: str) -> Record:
        if name in self._records or name in self._with_plug_ins():
            return self._records[name]
        raise SceneError([self.unknown(name)])

    def __contains__(self, name: object) -> bool:
        return name in self._records or name in self._with_plug_ins()

    def __iter__(self) -> Iterator[str]:
        return iter(self._with_plug_ins())

    def __len__(self) -> int:
        return len(self._with_plug_ins())

    def __setitem__(self, name: str, record: Record) -> None:
        self._records[name] = record

    def __delitem__(self, name: str) -> None:
        del self._records[name]

    def get(self, name: str, default: Any = None) -> Any:
        """Return the record of a name, or the default."""
        return self[name] if name in self else default  # noqa: SIM401 -- this is `get`

    def add(self, record: Any, source: str) -> None:
        """Add a record of a plug-in or a script, in place of any of the same name.

        Parameters
        ----------
        record : record
            Of the class of this registry.
        source : str
            Name and version of what it is from, for results.

        Raises
        ------
        SceneError
            For what is no record, a name that is no word or that of a shipped record,
            or a function that cannot be called.
        """
        self._with_plug_ins()  # load plug-ins now; later they would replace the record
        if not isinstance(record, self._class):
            kind, given = self._class.__name__, brief(repr(record))
            raise SceneError(
                [Fault(f"a {self.kind} must be a {kind}; given is {given}")]
            )
        name = record.name
        if not (isinstance(name, str) and name.isidentifier()):
            raise SceneError(
                [
                    Fault(
                        f"name = {name!r} of a {self.kind} must be one word, such as "
                        "linear"
                    )
                ]
            )
        if name in self._records and name not in self._sources:
            raise SceneError(
                [Fault(f'{self.kind} "{name}" is shipped; give yours another name')]
            )
        function = getattr(record, self._function) if self._function else None
        if self._function and not callable(function):
            raise SceneError(
                [Fault(f'{self._function} of {self.kind} "{name}" must be a function')]
            )
        self._sources[name] = source
        guarded = record
        if function is not None:
            safe = _guarded(function, f'{self.kind} "{name}" ({source})', self._returns)
            guarded = replace(record, **{self._function: safe})
        self._records[name] = guarded

    def source_of(self, name: str) -> str:
        """Name and version of the plug-in of a record, "" for shipped records."""
        return self._sources.get(name, "")

    def unknown(self, name: str, fitting: Iterable[str] | None = None) -> Fault:
        """Return the fault of an unknown name.

        The fault lists the names that are `fitting`, by default all of the registry.
        """
        if name in self.unusable:
            return Fault(f'{self.kind} "{name}" {self.unusable[name]}')
        return unknown(self.kind, name, self if fitting is None else fitting)

    def that_take(self, parameter: str) -> str:
        """Names of the records that have a parameter, formatted for messages."""
        records = self._records.items()
        takers = (
            name
            for name, record in records
            if parameter in getattr(record, "parameters", ())
        )
        return " or ".join(f'"{name}"' for name in takers)

    def _with_plug_ins(self) -> dict[str, Record]:
        """Return the records, with those of all installed packages."""
        if not self._searched:
            self._searched = True
            packages: dict[str, str] = {}
            for point in metadata.entry_points(group=self.group):
                source = (
                    f"{point.dist.name} {point.dist.version}"
                    if point.dist
                    else "an unknown package"
                )
                try:
                    self._add_point(point, source)
                except Exception as error:
                    self.unusable[point.name] = (
                        f"of {source} cannot be used: {_reason(error)}"
                    )
                if (first := packages.setdefault(point.name, source)) != source:
                    self._records.pop(point.name, None)
                    self.unusable[point.name] = (
                        f"is in {first} and in {source}; uninstall one of them"
                    )
        return self._records

    def _add_point(self, point: metadata.EntryPoint, source: str) -> None:
        record = point.load()
        name = getattr(record, "name", point.name)
        if name != point.name:
            raise PluginError(
                f"{point.value} has the name {name!r}; call the entry point so"
            )
        self.add(record, source)


def _reason(error: Exception) -> str:
    """Type of an error and the first line of its message.

    File and line are added for code outside wearsim.
    """
    first = str(error).partition("\n")[0]
    if isinstance(error, WearsimError):
        return first
    frames = traceback.extract_tb(error.__traceback__)
    theirs = [
        frame
        for frame in frames
        if frame.filename != __file__ and "importlib" not in frame.filename
    ]
    place = f" ({Path(theirs[-1].filename).name}:{theirs[-1].lineno})" if theirs else ""
    return f"{type(error).__name__}: {first}{place}"


def _guarded(
    function: Callable[..., Any], called: str, returns: type
) -> Callable[..., Any]:
    """Return a plug-in function whose errors become one line that names the plug-in."""

    @functools.wraps(function)
    def guarded(*given: Any, **named: Any) -> Any:
        try:
            value = function(*given, **named)
        except WearsimError:
            raise
        except Exception as error:
            raise PluginError(f"{called} failed: {_reason(error)}") from error
        if not isinstance(value, returns):
            raise PluginError(
                f"{called} returns a {type(value).__name__}, not a {returns.__name__}"
            )
        return value

    return guarded


def discover(
    kind: str,
    package: str,
    path: Iterable[str],
    record: type[Record],
    unusable: Mapping[str, str] | None = None,
    **options: Any,
) -> Registry[Record]:
    """Collect each `record` at the top of modules of a package, in alphabetical order.

    Parameters
    ----------
    kind : str
        Noun for a record in messages.
    package, path : str and iterable of str
        Name and `__path__` of the package.
    record : type
        Class of the records.
    unusable, **options
        As of `Registry`.
    """
    names = sorted(module.name for module in pkgutil.iter_modules(path))
    modules = [importlib.import_module(f"{package}.{name}") for name in names]
    records = (
        value
        for module in modules
        for value in vars(module).values()
        if isinstance(value, record)
    )
    return Registry(kind, records, unusable, record=record, **options)


def unknown(kind: str, name: str, known_names: Iterable[str]) -> Fault:
    """Fault of an unknown name, with the known names and the most similar one."""
    names = sorted(known_names)
    return Fault(
        f'{kind} "{name}" is unknown; there is '
        f"{', '.join(names) or 'none'}{suggestion(str(name), names)}"
    )


def check_grid(
    name: str,
    strips: int,
    cells: int,
    fewest: int,
    most_strips: int | None,
    hint: str = "",
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
        Further remedy for a coarse grid.

    Raises
    ------
    ContactError
        Without a row: a fault of no operating point.
    """
    if min(strips, cells) < fewest:
        raise ContactError(
            f"{name} needs at least {fewest} strips and cells along them; take "
            f"more{hint}"
        )
    if most_strips is not None and strips > most_strips:
        raise ContactError(
            f"{name} has room for {most_strips} strips at most; take fewer"
        )
