"""Wear and rolling contact fatigue of railway wheels, on a roller rig and in the field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wearsim.results import open_results

__all__ = ["__version__", "open_results"]

__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    """Import `open_results` on first use, so that the command line starts without numpy."""
    if name == "open_results":
        from wearsim.results import open_results

        return open_results
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
