"""Given path of a positioner's joints as written in a cell file."""

from typing import Annotated, Any, Final, Literal, Self

from pydantic import Field, model_validator

from cellplan.model.settings.entry import FARTHEST_MM, Angle, Entry, rule, setting

COEFFICIENT_LIMIT: Final = 400  # more are a table of the motion, not a spline

JointValue = Annotated[float, Field(ge=-FARTHEST_MM, le=FARTHEST_MM)]
Row = tuple[float, ...] | dict[str, Any]


class JointPathEntry(Entry):
    """The joints of a positioner as a B-spline over the common clock, at rest at both ends."""

    degree: Literal[3, 5] = setting(
        5, "Degree of the polynomials between two knots; the knots are evenly spaced over the clock."
    )
    coefficients_deg: tuple[tuple[Angle, ...], ...] | None = setting(
        None,
        "Coefficients, one configuration each with one angle per joint, for robots with revolute joints only. The "
        "first is the start posture, the last the end; both count three times, so that the joints begin and end at "
        "rest and without acceleration. The path passes near the others.",
        min_length=2,
        max_length=COEFFICIENT_LIMIT,
    )
    coefficients: tuple[dict[str, JointValue], ...] | None = setting(
        None,
        "The same with one key per joint with its unit (a1_deg, rail_mm); excludes coefficients_deg.",
        min_length=2,
        max_length=COEFFICIENT_LIMIT,
    )

    @model_validator(mode="after")
    def _is_given_once(self) -> Self:
        """Coefficients in one of both spellings."""
        if (self.coefficients_deg is None) == (self.coefficients is None):
            got = "neither" if self.coefficients is None else "both"
            raise rule(f"expected either coefficients_deg or coefficients, got {got}")
        return self

    @property
    def key(self) -> str:
        """The key under which the coefficients are given."""
        return "coefficients_deg" if self.coefficients is None else "coefficients"

    @property
    def rows(self) -> tuple[Row, ...]:
        """The coefficients as they are written."""
        return self.coefficients if self.coefficients is not None else self.coefficients_deg or ()
