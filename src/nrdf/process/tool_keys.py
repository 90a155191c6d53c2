"""Keys of a tool: its footprint and body, a gun's profile or a pad for the result of a process."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from nrdf.process.quantities import (
    Name,
    NotNegative,
    PlausibleRange,
    Positive,
    Quantities,
    Quaternion,
    Vector,
)

_LENGTH = PlausibleRange(0.0, 1.0)


class Profile(Quantities):
    """A spray gun's profile, on a plate at its stand-off."""

    shape: Literal["beta", "gaussian"] = "beta"
    """beta: ends at its half-widths; gaussian: they are its standard deviations."""
    across_m: Annotated[Positive, PlausibleRange(1e-3, 0.5)]
    """Half-width of the fan across the travel."""
    along_m: Annotated[Positive, PlausibleRange(1e-3, 0.5)]
    """Half-width of the fan along the travel."""
    across_exponent: Annotated[float, Field(strict=True, ge=1.0, le=50.0)] = 2.0
    """Of a beta profile, across: 1 a box, 2 a parabola, more a peak."""
    along_exponent: Annotated[float, Field(strict=True, ge=1.0, le=50.0)] = 2.0
    """Of a beta profile, along."""
    flow_m3_s: Annotated[Positive, PlausibleRange(1e-11, 1e-4)]
    """Film that arrives on a wide plate, each second: flow of paint by its solids and what losses
    leave of it."""
    standoff_m: Annotated[Positive | None, PlausibleRange(1e-3, 1.0)] = None
    """Where the profile was measured; unless given, the process's stand-off."""


class PadKeys(Quantities):
    """A sanding or polishing pad."""

    stiffness_n_m3: Annotated[Positive, PlausibleRange(1e5, 1e10)] = 2e7
    """Pressure for each metre that it is pressed in: modulus of its foam by its thickness."""
    preston_per_pa: Annotated[Positive, PlausibleRange(1e-13, 1e-6)]
    """Depth for each pascal and metre of sliding: of grit and material, from a trial."""
    orbit_m: Annotated[NotNegative, PlausibleRange(0.0, 0.02)] = 0.0
    """Radius of the orbit of an orbital sander; 0: a disc that spins about its own axis."""


class Tool(Quantities):
    """What touches or faces the surface."""

    name: Name = "tool"
    """Its name, for the robot's program."""
    radius_m: Annotated[Positive, PlausibleRange(1e-4, 0.5)]
    """Radius of its footprint on the surface."""
    clearance_m: Annotated[NotNegative, _LENGTH] = 0.0
    """Free space that it needs above the surface, along the normal; planned paths leave out places
    that have less, such as crevices. 0: not checked."""
    body_length_m: Annotated[Positive | None, _LENGTH] = None
    """Length of its body, a cylinder that reaches back from the tool centre point along its axis.
    With it, planned paths leave out places where the body would touch the object, and where it
    still would is warned of."""
    body_radius_m: Annotated[Positive | None, _LENGTH] = None
    """Radius of that cylinder; unless given, that of the footprint."""
    tcp_m: Annotated[Vector | None, PlausibleRange(-2.0, 2.0)] = None
    """Tool centre point in the robot's flange frame."""
    tcp_quaternion_xyzw: Quaternion | None = None
    """Rotation from the tool frame (z into the part) to the flange frame."""
    profile: Profile | None = None
    """Of a spray gun: how much film it lays where."""
    pad: PadKeys | None = None
    """Of a sander or polisher: how much it takes off."""

    @property
    def radius_of_body_m(self) -> float:
        """The body's radius, given or that of the footprint."""
        return self.radius_m if self.body_radius_m is None else self.body_radius_m

    @model_validator(mode="after")
    def _body_has_a_length(self) -> Tool:
        if self.body_radius_m is not None and self.body_length_m is None:
            raise ValueError("body_radius_m needs body_length_m")
        return self
