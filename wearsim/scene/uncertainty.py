"""[uncertainty] of a scene: which inputs are uncertain and how, which steels are compared."""

from __future__ import annotations

from typing import Any, Literal

from wearsim.scene.section import Section, Text


class InputSection(Section):
    """[[uncertainty.input]]: one uncertain key of the scene and its distribution."""

    key: Text
    name: Text | None = None
    distribution: Literal["uniform", "normal", "lognormal", "values"]
    low: float | None = None
    high: float | None = None
    mean: float | None = None
    std: float | None = None
    median: float | None = None
    within: float | None = None
    values: tuple[float | int | str | dict[str, Any], ...] = ()
    acts: Literal["value", "factor", "addition"] = "value"
    shared: bool = False
    source: Text | None = None

    @property
    def label(self) -> str:
        """Name for tables."""
        return self.name or self.key


class MaterialSection(Section):
    """[[uncertainty.material]]: another steel, to be ranked against that of the scene."""

    name: Text
    wear: dict[str, Any]
    source: Text | None = None


class UncertaintySection(Section):
    """[uncertainty]: what `wearsim run SCENE --bands` draws, and how often."""

    draws: int = 64
    most_draws: int | None = None
    seed: int = 1
    input: tuple[InputSection, ...] = ()
    material: tuple[MaterialSection, ...] = ()
