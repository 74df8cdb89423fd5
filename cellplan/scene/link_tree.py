"""How many joints lie between two links of a robot, links without a body left out."""

from typing import Final

from cellplan.model.robot.robot import BASE, FollowerJoint, Joint, RobotModel

NO_BODY: Final = BASE - 1  # stands for "no link before this one has a body"


class LinkTree:
    """The links of one robot that have bodies, each joined to the nearest one before it."""

    def __init__(self, model: RobotModel) -> None:
        """Take the joints and the links that have bodies."""
        axes: tuple[Joint | FollowerJoint, ...] = (*model.joints, *model.followers)
        self._parents = [axis.parent for axis in axes]
        self._names = [axis.name for axis in axes]
        self._bars = set(range(len(model.joints), len(axes))) - set(model.links_to_flange)
        self._with_body = {body.link for body in model.bodies}

    def carrier(self, link: int) -> int:
        """The link itself when it has a body, else the nearest before it that has one; ``NO_BODY`` when none has."""
        while link != BASE and link not in self._with_body:
            link = self._parents[link]
        return link if link in self._with_body else NO_BODY

    def parent(self, link: int) -> int:
        """The nearest link with a body before a link; ``NO_BODY`` when there is none."""
        return NO_BODY if link in (BASE, NO_BODY) else self.carrier(self._parents[link])

    def is_bar(self, link: int) -> bool:
        """Whether a link is moved through a linkage and does not carry the flange: a bar that closes a loop."""
        return link in self._bars

    def joint_name(self, link: int) -> str:
        """Name of the joint that moves a link."""
        return self._names[link]

    def joints_between(self, first: int, second: int) -> int:
        """Number of joints between two links that have bodies, joints that carry none left out."""
        up_first, up_second = self._path_down(first), self._path_down(second)
        return min(i + j for i, link in enumerate(up_first) for j, other in enumerate(up_second) if link == other)

    def _path_down(self, link: int) -> list[int]:
        """The link, the ones before it, and ``NO_BODY`` last."""
        path = [link]
        while path[-1] != NO_BODY:
            path.append(self.parent(path[-1]))
        return path
