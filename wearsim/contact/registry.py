"""Shared by normal and tangential models: the search of a folder for models, and the limits of grids."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable
from typing import Any

from wearsim.errors import ContactError


def models_in(package: str, path: Iterable[str]) -> dict[str, Any]:
    """Collect the ``MODEL`` of every module and folder of a package that defines one.

    Parameters
    ----------
    package : str
        Name of the package.
    path : iterable of str
        Its ``__path__``.

    Returns
    -------
    dict
        Records by name, in alphabetical order.
    """
    modules = [importlib.import_module(f"{package}.{info.name}") for info in pkgutil.iter_modules(path)]
    records = [module.MODEL for module in modules if hasattr(module, "MODEL")]
    return {record.name: record for record in sorted(records, key=lambda record: str(record.name))}


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
