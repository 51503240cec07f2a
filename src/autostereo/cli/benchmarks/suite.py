"""What all benchmarks share: switches, works, and running the works that were chosen."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from ...errors import InputError
from .harness import Figure

Say = Callable[[str], object]


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
        Folder with meshes/bun_zipper.ply, the Stanford bunny (mesh only).
    repeats : int, optional
        Rounds; None: 7, or 3 if quick.
    specular : float
        Weight of the material's highlight in per-sample-lit works (mesh only).
    engine : str
        Name of the engine that is measured.
    shrink : int
        By how much lengths of pictures and volumes are divided if quick.
    """

    quick: bool = False
    only: tuple[str, ...] = ()
    data: Path | None = None
    repeats: int | None = None
    specular: float = 0.0
    engine: str = "cpu"
    shrink: int = 4

    def __post_init__(self) -> None:
        if self.repeats is not None and self.repeats < 1:
            raise InputError(f"bench repeats: expected a whole number ≥ 1, got {self.repeats}")
        if self.shrink < 1:
            raise InputError(f"bench shrink: expected a whole number ≥ 1, got {self.shrink}")
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
    works: Mapping[str, Work[S]], studio: S, options: BenchOptions, say: Say, without: tuple[str, ...] = ()
) -> list[dict[str, Any]]:
    """Measure the chosen works, but for the scenes in `without`.

    Returns
    -------
    list of dict
        The fields of `harness.Figure`: work, scene, lighting, measure, value with its noise band low … high, unit,
        bar, met (None where nothing is asked, or if quick), times by contender in seconds, note.
    """
    figures: list[Figure] = []
    for chosen in options.only or tuple(works):
        work = works[chosen]
        for scene in work.scenes:
            if scene in without:
                continue
            for lighting in work.lightings:
                say(" · ".join(word for word in (work.title, scene, lighting and f"lit per {lighting}") if word))
                figures += work.figures(studio, scene, lighting)
    results = [figure.as_dict() for figure in figures]
    if options.quick:
        results = [figure | {"met": None} for figure in results]
    return results


def check_works(name: str, works: Mapping[str, Any], only: tuple[str, ...]) -> None:
    """Raise InputError when a name in `only` is no work of benchmark `name`."""
    unknown = [work for work in only if work not in works]
    if unknown:
        raise InputError(f"bench {name}: there is no work {unknown[0]!r}; there are {', '.join(works)}")
