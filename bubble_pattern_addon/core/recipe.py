"""The whole of a designer's choices as one dataclass tree."""

from __future__ import annotations

from dataclasses import dataclass, field

from .metric import Constant, Field


@dataclass(frozen=True)
class RegionChoice:
    """Which faces of the base are the target region: exactly one of near, attribute, material and all."""

    near: tuple[float, float, float] | None = None
    max_angle: float = 20.0
    attribute: str | None = None
    material: str | None = None
    all: bool = False


@dataclass(frozen=True)
class Packing:
    """Step 1. pitch is the packing metric: the distance of neighbouring centres."""

    pitch: Field = Constant(3.0)
    edge_offset: float = 0.0
    integrator: str = "fire"
    seed: int = 0
    iterations: int = 400
    tolerance: float = 1e-3


@dataclass(frozen=True)
class Shaping:
    """Step 2. diameter is the shaping metric."""

    diameter: Field = Constant(1.8)


@dataclass(frozen=True)
class Feature:
    """What one feature is. depth None: through the near wall; facets by chord height, at least min_sides."""

    kind: str = "hole"
    depth: float | None = None
    sides: int | None = None
    tolerance: float | None = None


@dataclass(frozen=True)
class Limits:
    """What must remain: min_web between two features, min_margin from a feature's edge to the boundary."""

    min_web: float = 0.0
    min_margin: float = 0.0


@dataclass(frozen=True)
class Output:
    """What a batch run leaves behind besides features.csv, report.json and part.stl."""

    blend: bool = False
    picture: bool = False


@dataclass(frozen=True)
class Recipe:
    """Everything that makes one pattern."""

    region: RegionChoice = field(default_factory=RegionChoice)
    packing: Packing = field(default_factory=Packing)
    shaping: Shaping = field(default_factory=Shaping)
    feature: Feature = field(default_factory=Feature)
    limits: Limits = field(default_factory=Limits)
    output: Output = field(default_factory=Output)
