"""Rung: how the transfer move of a robot was found."""

from enum import StrEnum


class Rung(StrEnum):
    """The ways in which transfer moves are planned, in the order in which they are tried."""

    STRAIGHT = "straight"  # all robots that move, straight in joint space, together
    IN_TURN = "in_turn"  # one robot after the other, all others standing
    IN_TIME = "in_time"  # in joint space and time, against the motion of the robots planned before

    @property
    def words(self) -> str:
        """How it reads in a report."""
        return {Rung.STRAIGHT: "straight", Rung.IN_TURN: "one after the other", Rung.IN_TIME: "beside the others"}[self]
