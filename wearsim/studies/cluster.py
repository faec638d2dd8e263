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
    by_file, fix = address.endswith(".json"), "start one with `dask scheduler`, and give its address"
    if by_file and not Path(address).is_file():
        raise ResultError(f"{address}: there is no such file of a Dask scheduler; {fix}")
    try:
        from distributed import Client
    except ImportError as error:
        message = f"a cluster needs Dask, and {error.name} is not installed: pip install 'wearsim[cluster]'"
        raise ResultError(message) from error
    try:
        # not the default client, or xarray would ask it for its locks
        client = Client(**{"scheduler_file" if by_file else "address": address}, set_as_default=False)
    except (OSError, ValueError) as error:
        reason = str(error).partition("\n")[0]
        raise ResultError(f"{address}: no Dask scheduler answers ({reason}); {fix}") from error
    with client:
        yield client.get_executor(pure=False)
