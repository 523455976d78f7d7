"""Which parts the joints of a chain connect, in which order to sweep, and where labels belong."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from ..errors import AmbiguousDofError, FbsError, JointError, UnknownDofError, unknown_dof
from ..joints import Joint, Node

Labels = tuple[tuple[str, ...], tuple[str, ...]]
"""Responses and excitations of a part."""


Places = slice | list[int]
"""Of some of a part's joints; a slice where they follow each other, so that blocks are views."""


@dataclass(frozen=True)
class Ends:
    """The joints of one part, grouped by connection.

    Parameters
    ----------
    labels : tuple of str
        The part's interface, each label once.
    place : tuple of int
        For each joint, the place of its label in `labels`.
    signs : tuple of float
        For each joint, the entry of B.
    joints : list of int
        Their numbers among all joints.
    here, others : mapping of int to Places
        For each connection, its joints and those of all other connections.
    """

    labels: tuple[str, ...]
    place: tuple[int, ...]
    signs: tuple[float, ...]
    joints: list[int]
    here: Mapping[int, slice]
    others: Mapping[int, Places]

    @classmethod
    def of(cls, sides: Mapping[int, Sequence[tuple[int, str, float]]]) -> Ends:
        """Arrange (joint, label, entry of B) by connection."""
        flat = [side for group in sides.values() for side in group]
        labels = tuple(dict.fromkeys(label for _, label, _ in flat))
        here, start = {}, 0
        for connection, group in sides.items():
            here[connection] = slice(start, start + len(group))
            start += len(group)
        return cls(
            labels,
            tuple(labels.index(label) for _, label, _ in flat),
            tuple(sign for _, _, sign in flat),
            [joint for joint, _, _ in flat],
            here,
            {connection: _all_but(part, start) for connection, part in here.items()},
        )


def _all_but(part: slice, size: int) -> Places:
    if part.start == 0:
        return slice(part.stop, size)
    if part.stop == size:
        return slice(0, part.start)
    return [*range(part.start), *range(part.stop, size)]


@dataclass(frozen=True)
class Tree:
    """Parts and their connections, without loops.

    Parameters
    ----------
    labels : mapping of str to (responses, excitations)
    joints : tuple of Joint
    connections : tuple of (first part, second part)
    ends : mapping of str to Ends
    order : tuple of (part, connection)
        Messages, each after those it needs.
    """

    labels: Mapping[str, Labels]
    joints: tuple[Joint, ...]
    connections: tuple[tuple[str, str], ...]
    ends: Mapping[str, Ends]
    order: tuple[tuple[str, int], ...]

    @classmethod
    def of(cls, labels: Mapping[str, Labels], joints: Sequence[Joint]) -> Tree:
        """Arrange the joints.

        Raises
        ------
        JointError, UnknownDofError, FbsError
        """
        if not labels:
            raise FbsError("no parts given")
        for joint in joints:
            _require_interface(joint, labels)
        grouped: dict[tuple[str, str], list[int]] = {}
        for k, joint in enumerate(joints):
            pair = (joint.first[0], joint.second[0])
            grouped.setdefault(pair if pair[::-1] not in grouped else pair[::-1], []).append(k)
        for members in grouped.values():
            _refuse_redundant([joints[k] for k in members])
        connections = tuple(grouped)
        ends = {name: _ends(name, joints, grouped) for name in labels}
        return cls(dict(labels), tuple(joints), connections, ends, _order(connections, labels))

    def other(self, name: str, connection: int) -> str:
        """Return the part at the other end of a connection."""
        first, second = self.connections[connection]
        return second if name == first else first

    def owners(self, wanted: Sequence[str], role: int) -> tuple[Node, ...]:
        """Return (part, label) of each label; role 0: responses, 1: excitations.

        Raises
        ------
        AmbiguousDofError, UnknownDofError
        """
        nodes: dict[str, list[Node]] = {}
        for name, labels in self.labels.items():
            for label in labels[role]:
                nodes.setdefault(label, []).append((name, label))
        result = []
        for label in wanted:
            if label not in nodes:
                raise unknown_dof(label, tuple(nodes), "the chain")
            first, *others = nodes[label]
            motions = _rigid_motions(self.joints, first) if others else {}
            for node in others:
                if abs(motions.get(node, 0.0) - 1.0) > 1e-12:  # ratios round
                    raise AmbiguousDofError(
                        f"{label!r} is in {first[0]!r} and in {node[0]!r}, and no rigid joint "
                        "makes them one motion; give one of them another name"
                    )
            result.append(first)
        return tuple(result)

    def paths(self, start: str, targets: set[str]) -> Iterator[tuple[str, int | None]]:
        """Yield the parts on the ways from `start` to `targets`, outward.

        Each with the connection by which it is entered (None: `start` itself).
        """
        entered: dict[str, int | None] = {start: None}
        queue = [start]
        for name in queue:
            for connection in self.ends[name].here:
                other = self.other(name, connection)
                if other not in entered:
                    entered[other] = connection
                    queue.append(other)
        needed = {start}
        for name in targets & entered.keys():
            while name not in needed:
                needed.add(name)
                back = entered[name]
                assert back is not None
                name = self.other(name, back)
        return ((name, entered[name]) for name in queue if name in needed)


def _require_interface(joint: Joint, labels: Mapping[str, Labels]) -> None:
    for name, label in (joint.first, joint.second):
        if name not in labels:
            raise UnknownDofError(f"{joint}: there is no part {name!r}, only {', '.join(labels)}")
        for role, known in zip(("responses", "excitations"), labels[name], strict=True):
            if label not in known:
                raise unknown_dof(label, known, f"{joint}: among its {role} part {name!r}")
    if joint.first[0] == joint.second[0]:
        raise JointError(f"{joint} lies within one part and closes a loop; use couple")


def _refuse_redundant(joints: Sequence[Joint]) -> None:
    """Refuse a rigid joint whose ends the earlier ones of its connection tie already."""
    for k, joint in enumerate(joints):
        if joint.rigid and joint.second in _rigid_motions(joints[:k], joint.first):
            raise JointError(
                f"{joint} is redundant: other rigid joints tie these two already, and the kernel "
                "would be singular at every line; leave it out"
            )


def _rigid_motions(joints: Sequence[Joint], start: Node) -> dict[Node, float]:
    """Return every node tied rigidly to `start`, with its motion per unit motion of `start`."""
    motions, queue = {start: 1.0}, [start]
    rigid = [joint for joint in joints if joint.rigid]
    for node in queue:
        for joint in rigid:
            if node == joint.first and joint.second not in motions:
                motions[joint.second] = motions[node] / joint.ratio
                queue.append(joint.second)
            elif node == joint.second and joint.first not in motions:
                motions[joint.first] = motions[node] * joint.ratio
                queue.append(joint.first)
    return motions


def _ends(name: str, joints: Sequence[Joint], grouped: Mapping[tuple[str, str], list[int]]) -> Ends:
    sides = {}
    for connection, (pair, members) in enumerate(grouped.items()):
        if name in pair:
            sides[connection] = [(k, *_end(name, joints[k])) for k in members]
    return Ends.of(sides)


def _end(name: str, joint: Joint) -> tuple[str, float]:
    """Return a part's label at a joint and the entry of B: +1 first, -ratio second."""
    return (joint.first[1], 1.0) if joint.first[0] == name else (joint.second[1], -joint.ratio)


def _order(
    connections: Sequence[tuple[str, str]], labels: Mapping[str, Labels]
) -> tuple[tuple[str, int], ...]:
    """Order the messages: from the leaves to a root, then back; refuse a loop."""
    neighbours: dict[str, list[tuple[int, str]]] = {name: [] for name in labels}
    for connection, (first, second) in enumerate(connections):
        neighbours[first].append((connection, second))
        neighbours[second].append((connection, first))
    outward: list[tuple[str, int, str]] = []  # parent, connection, child
    entered: dict[str, int | None] = {}
    for root in labels:
        if root in entered:
            continue
        entered[root], queue = None, [root]
        for name in queue:
            for connection, other in neighbours[name]:
                if connection == entered[name]:
                    continue
                if other in entered:
                    raise JointError(
                        f"the joints between {name!r} and {other!r} close a loop of parts; "
                        "use couple"
                    )
                entered[other] = connection
                outward.append((name, connection, other))
                queue.append(other)
    inward = [(child, connection) for _, connection, child in reversed(outward)]
    return (*inward, *((parent, connection) for parent, connection, _ in outward))
