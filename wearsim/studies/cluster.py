"""Cases on other machines: the executor of a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path

from wearsim.errors import ResultError


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """Connect to a Dask cluster, whose workers take cases.

    Dask gives a case whose worker died to another one, which continues it from its last finished step; after
    the deaths of `distributed.scheduler.allowed-failures` workers, 3 by default, the case has failed.

    Parameters
    ----------
    address : str
        Address of the scheduler, such as tcp://node1:8786, or its scheduler file, which ends with .json.

    Raises
    ------
    ResultError
        If Dask is not installed, or no scheduler answers.
    """
    try:
        from distributed import Client
    except ImportError as error:
        message = f"a cluster needs Dask, and {error.name} is not installed: pip install 'wearsim[cluster]'"
        raise ResultError(message) from error
    by_file = address.endswith(".json")
    try:
        if by_file and not Path(address).is_file():
            raise FileNotFoundError("there is no such scheduler file")
        # not the default, or xarray would ask it for its locks
        where = {"scheduler_file": address} if by_file else {"address": address}
        client = Client(**where, set_as_default=False)
    except (OSError, ValueError) as error:
        message = f"{address}: no Dask scheduler answers ({str(error).splitlines()[0]})"
        raise ResultError(f"{message}; start one with `dask scheduler`, and give its address") from error
    with client:
        yield client.get_executor(pure=False)
