"""What all benchmarks share: switches, works, and running the works that were chosen."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from ...errors import InputError
from .harness import Figure

Say = Callable[[str], object]
Results = list[dict[str, Any]]
Keep = Callable[[Results], object]  # is given all figures so far, whenever there are more


@dataclass(frozen=True)
class BenchOptions:
    """Switches of a benchmark.

    Parameters
    ----------
    quick : bool
        Small pictures of small scenes, three rounds: shows that all works; its figures are held to no bar.
    only : tuple of str
        Names of works; empty: all.
    data : Path, optional
        Folder with meshes/bun_zipper.ply, the Stanford bunny (mesh); with meshes and volumes of the papers (papers).
    repeats : int, optional
        Rounds; None: 7, or 3 if quick.
    specular : float
        Weight of the material's highlight in per-sample-lit works (mesh only).
    engine : str
        Name of the engine that is measured.
    shrink : int
        By how much lengths of pictures and volumes are divided if quick.
    budget : float, optional
        Seconds after which no work is begun any more; None: all are done.
    """

    quick: bool = False
    only: tuple[str, ...] = ()
    data: Path | None = None
    repeats: int | None = None
    specular: float = 0.0
    engine: str = "cpu"
    shrink: int = 4
    budget: float | None = None

    def __post_init__(self) -> None:
        if self.repeats is not None and self.repeats < 1:
            raise InputError(f"bench repeats: expected a whole number ≥ 1, got {self.repeats}")
        if self.shrink < 1:
            raise InputError(f"bench shrink: expected a whole number ≥ 1, got {self.shrink}")
        if self.budget is not None and not self.budget > 0:
            raise InputError(f"bench budget: expected seconds > 0, got {self.budget:g}")
        if self.specular < 0:
            raise InputError(f"bench specular: expected a number ≥ 0, got {self.specular:g}")

    @property
    def rounds(self) -> int:
        """Number of rounds."""
        return self.repeats or (3 if self.quick else 7)

    @property
    def divisor(self) -> int:
        """By how much lengths are divided."""
        return self.shrink if self.quick else 1


S = TypeVar("S", contravariant=True)


@dataclass(frozen=True)
class Work(Generic[S]):
    """A row of the table: its title and how it is measured, per scene and lighting where it has them."""

    title: str
    figures: Callable[[S, str, str], list[Figure]]
    scenes: tuple[str, ...] = ("",)
    lightings: tuple[str, ...] = ("",)


def run_works(
    works: Mapping[str, Work[S]],
    studio: S,
    options: BenchOptions,
    say: Say,
    without: tuple[str, ...] = (),
    keep: Keep = lambda results: None,
) -> Results:
    """Measure the chosen works, but for the scenes in `without`, until the budget is spent.

    Returns
    -------
    list of dict
        The fields of `harness.Figure`: work, scene, lighting, measure, value with its noise band low … high, unit,
        bar, met (None where nothing is asked, or if quick), times by contender in seconds, note, published.
    """
    results: Results = []
    end = math.inf if options.budget is None else time.monotonic() + options.budget
    for chosen in options.only or tuple(works):
        work = works[chosen]
        for scene in work.scenes:
            if scene in without:
                continue
            for lighting in work.lightings:
                title = " · ".join(word for word in (work.title, scene, lighting and f"lit per {lighting}") if word)
                if time.monotonic() >= end:
                    say(f"left out, the budget of {options.budget:g} s is spent: {title}")
                    continue
                say(title)
                found = [figure.as_dict() for figure in work.figures(studio, scene, lighting)]
                results += [figure | {"met": None} for figure in found] if options.quick else found
                keep(results)
    return results


def check_works(name: str, works: Mapping[str, Any], only: tuple[str, ...]) -> None:
    """Raise InputError when a name in `only` is no work of benchmark `name`."""
    unknown = [work for work in only if work not in works]
    if unknown:
        raise InputError(f"bench {name}: there is no work {unknown[0]!r}; there are {', '.join(works)}")
