"""Reading the bodies and springs of an exudyn system back from it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contact.involute_mesh import tangent_points
from ..model.parameters import Drivetrain
from ..stages.part import mesh_name
from .components import GROUND, Components, End, Spring, SpringKind
from .drivetrain import MultibodySystem, build_drivetrain
from .elements import Mesh
from .linearization import coordinate_transform

Array = NDArray[np.float64]


def drivetrain_components(drivetrain: Drivetrain) -> Components:
    """Springs and bodies of a drivetrain as exudyn has them."""
    return components(build_drivetrain(drivetrain))


def components(system: MultibodySystem, motion: Array | None = None) -> Components:
    """Read the springs and bodies of an assembled system.

    Parameters
    ----------
    system
        As built.
    motion
        (n_dof,) from there to where the meshes' deflections are looked at; None: as built.
    """
    reader = _Reader(system, motion)
    mass, _, _ = system.mbs.ComputeLinearizedSystem()
    rows = {name: reader.rows(name) for name in system.bodies}
    return Components(
        dofs=tuple(dof.label for dof in system.dofs),
        springs=tuple(reader.springs()),
        motions={name: reader.transform[own] for name, own in rows.items()},
        masses={name: np.asarray(mass)[own, own] for name, own in rows.items()},
    )


AXIAL = np.array([0.0, 0.0, 1.0])


class _Reader:
    """Walks through exudyn's objects; its indices are types of their own, compared as int."""

    def __init__(self, system: MultibodySystem, motion: Array | None) -> None:
        self.system, self.mbs = system, system.mbs
        self.transform = coordinate_transform(system)
        self.moved = self.transform @ (np.zeros(len(system.dofs)) if motion is None else motion)
        self.by_object = {int(b.object_number): name for name, b in system.bodies.items()}
        self.by_node = {int(b.node_number): name for name, b in system.bodies.items()}
        self.meshes = {int(mesh.object_number): mesh for mesh in system.meshes.values()}
        self.markers = [self.mbs.GetMarker(i) for i in range(self.mbs.systemData.NumberOfMarkers())]

    def rows(self, body: str) -> slice:
        """Where a body's coordinates stand among exudyn's."""
        found = self.system.bodies[body]
        first = self.mbs.GetNodeODE2Index(found.node_number)
        return slice(first, first + found.coordinates)

    def springs(self) -> list[Spring]:
        """Every spring that has a stiffness, in the order they were added."""
        found: list[Spring] = []
        for number in range(self.mbs.systemData.NumberOfObjects()):
            item = self.mbs.GetObject(number)
            if number in self.meshes:
                found += self._mesh(self.meshes[number])
            if not np.any(item.get("stiffness", 0.0)):
                continue
            match item["objectType"]:
                case "ConnectorRigidBodySpringDamper":
                    found += self._bearing(item)
                case "ConnectorCoordinateSpringDamper":
                    found.append(self._coordinate_spring(item))
        return found

    def _end(self, marker: dict[str, Any]) -> End:
        if marker["markerType"] == "NodeCoordinate":
            body = self.by_node.get(int(marker["nodeNumber"]), GROUND)
            centre = self.system.bodies[body].centre if body != GROUND else np.zeros(3)
            return End(body, centre)
        position = np.asarray(marker["localPosition"])
        body = self.by_object.get(int(marker["bodyNumber"]), GROUND)
        if body == GROUND:
            return End(body, position)
        return End(body, self.system.bodies[body].centre + position)

    def _motion(self, end: End) -> Array:
        """Displacement and rotation (6, n_dof) of a point of a body: u + θ × p, θ."""
        motion = np.zeros((6, self.transform.shape[1]))
        if end.body == GROUND:
            return motion
        body = self.system.bodies[end.body]
        x, y, z = end.point - body.centre
        lever = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        rigid = np.block([[np.eye(3), lever], [np.zeros((3, 3)), np.eye(3)]])
        own = {3: range(6), 2: (0, 1, 5), 1: (5,)}[body.dimension]
        return rigid[:, list(own)] @ self.transform[self.rows(end.body)]

    def _mesh(self, mesh: Mesh) -> list[Spring]:
        """A mesh by its mean stiffness, whatever force law it has, along its deflection δ."""
        if mesh.stiffness == 0.0:
            return []
        names = [self.by_node[int(body.node_number)] for body in mesh.bodies]
        rows = np.concatenate([self.transform[self.rows(name)] for name in names])
        moved = np.concatenate([self.moved[self.rows(name)] for name in names])
        first, second = (
            End(name, body.centre + point)
            for name, body, point in zip(names, mesh.bodies, tangent_points(mesh.pair), strict=True)
        )
        along = second.point - first.point
        return [
            Spring(
                mesh_name(*names),
                SpringKind.MESH,
                (first, second),
                (along / np.linalg.norm(along))[:, None],
                np.array([[mesh.stiffness]]),
                (mesh.row(moved) @ rows)[None],
                np.array([[mesh.damping]]),
            )
        ]

    def _bearing(self, item: dict[str, Any]) -> list[Spring]:
        """A six-dimensional spring as its translational and its rotational part."""
        markers = [self.markers[m] for m in item["markerNumbers"]]
        support, body = (self._end(marker) for marker in markers)
        axes = np.asarray(markers[0]["localHT"])[:3, :3]
        motion = self._motion(body) - self._motion(support)
        stiffness, damping = np.asarray(item["stiffness"]), np.asarray(item["damping"])
        found = []
        for kind, part in ((SpringKind.BEARING, slice(0, 3)), (SpringKind.ROCKING, slice(3, 6))):
            block = stiffness[part, part]
            used = np.flatnonzero(np.any(block, axis=0))
            if len(used):
                found.append(
                    Spring(
                        f"{kind} {body.body}",
                        kind,
                        (support, body),
                        axes[:, used],
                        block[np.ix_(used, used)],
                        axes[:, used].T @ motion[part],
                        damping[part, part][np.ix_(used, used)],
                    )
                )
        return found

    def _coordinate_spring(self, item: dict[str, Any]) -> Spring:
        markers = [self.markers[m] for m in item["markerNumbers"]]
        first, second = (self._end(marker) for marker in markers)
        if first.body == GROUND:
            first = End(GROUND, second.point)
        coordinate = markers[1]["coordinate"]
        turns = coordinate == self.system.bodies[second.body].rotation
        axis = AXIAL if turns else np.eye(3)[coordinate]
        part = slice(3, 6) if turns else slice(0, 3)
        stretch = axis @ (self._motion(second) - self._motion(first))[part]
        if first.body == GROUND:
            kind, name = SpringKind.TORSION, f"{SpringKind.TORSION} {second.body}"
        else:
            kind = SpringKind.SHAFT if turns else SpringKind.TRANSLATION
            name = f"{kind} {first.body} – {second.body}"
        return Spring(
            name,
            kind,
            (first, second),
            axis[:, None],
            np.array([[item["stiffness"]]]),
            stretch[None],
            np.array([[item["damping"]]]),
        )
