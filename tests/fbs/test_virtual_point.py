"""A rigid body is its own virtual point: exact, and a wrong channel is found out."""

from __future__ import annotations

import numpy as np
import pytest

from fbs import FbsError, Frf
from fbs.virtual_point import MOTIONS, Channel, VirtualPoint, transform

MASS = np.diag([2.0, 2.0, 2.0, 0.01, 0.02, 0.03])
LINES = np.linspace(50.0, 500.0, 10)
POINT = (0.01, -0.02, 0.03)
CORNERS = [(0.1, 0.0, 0.0), (0.0, 0.1, 0.02), (-0.05, -0.08, 0.05)]
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def channels(prefix: str) -> tuple[Channel, ...]:
    """Three triaxial ones."""
    return tuple(
        Channel(f"{prefix}{number}{axis}", place, direction)
        for number, place in enumerate(CORNERS, start=1)
        for axis, direction in AXES.items()
    )


SENSORS, IMPACTS = channels("s"), channels("h")
U = VirtualPoint("v", SENSORS, POINT)
F = VirtualPoint("v", IMPACTS, POINT)


def body() -> Frf:
    """Y = −(ω²M)⁻¹ of a free rigid body at the point, seen by the channels; and a far sensor."""
    at_point = -np.linalg.inv(MASS)[None] / (2.0 * np.pi * LINES)[:, None, None] ** 2
    far = Channel("far", (0.3, 0.2, 0.1), (0.0, 0.6, 0.8)).row(np.asarray(POINT))
    read = np.vstack([U.matrix, far])
    values = read @ at_point @ F.matrix.T
    labels = (*(c.label for c in SENSORS), "far")
    return Frf(LINES, values, labels, tuple(c.label for c in IMPACTS))


def test_a_rigid_body_comes_out_exactly() -> None:
    found = transform(body(), [U], [F])
    assert found.frf.responses == (*(f"v.{motion}" for motion in MOTIONS), "far")
    expected = -np.linalg.inv(MASS)[None] / (2.0 * np.pi * LINES)[:, None, None] ** 2
    np.testing.assert_allclose(found.frf.values[:, :6], expected, atol=1e-9 * abs(expected).max())
    for share in (*found.sensors.values(), *found.impacts.values(), *found.sensor_share.values()):
        np.testing.assert_allclose(share, 1.0, rtol=1e-9)


@pytest.mark.parametrize("wrong", ["s2y", "h3z"])
def test_a_channel_of_wrong_sign_is_found(wrong: str) -> None:
    frf = body()
    values = np.array(frf.values)
    if wrong in frf.responses:
        values[:, frf.responses.index(wrong)] *= -1.0
    else:
        values[:, :, frf.excitations.index(wrong)] *= -1.0
    found = transform(Frf(LINES, values, frf.responses, frf.excitations), [U], [F])
    shares = {**found.sensors, **found.impacts}
    assert min(shares, key=lambda label: shares[label].mean()) == wrong
    assert shares[wrong].max() < 1e-12  # the others say the opposite


def test_a_channel_that_no_other_checks_says_nothing() -> None:
    """Six channels for six motions: whatever they read is a motion."""
    places = [*((0.1, 0.0, 0.0),) * 3, (0.0, 0.1, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1)]
    axes = ["x", "y", "z", "x", "z", "y"]
    six = tuple(
        Channel(f"s{k}", place, AXES[axis])
        for k, (place, axis) in enumerate(zip(places, axes, strict=True))
    )
    labels = tuple(c.label for c in six)
    frf = Frf(LINES, np.random.default_rng(0).standard_normal((10, 6, 1)), labels, ("h",))
    found = transform(frf, [VirtualPoint("v", six, (0.0, 0.0, 0.0))])
    assert all(np.isnan(share).all() for share in found.sensors.values())


def test_a_flexible_motion_is_one_more_column() -> None:
    """Each corner out along x: no rigid motion; with it among the motions all is explained."""
    breathing = np.array([1.0, 0.0, 0.0, -0.5, 0.0, 0.0, 0.7, 0.0, 0.0])
    flexible = VirtualPoint("v", SENSORS, POINT, flexible={"breathing": breathing})
    frf = body()
    values = np.array(frf.values)
    values[:, :9] += 1e-7 * breathing[None, :, None]
    bent = Frf(LINES, values, frf.responses, frf.excitations)
    assert transform(bent, [U], [F]).sensor_share["v"].min() < 0.99
    found = transform(bent, [flexible], [F])
    np.testing.assert_allclose(found.sensor_share["v"], 1.0, rtol=1e-9)
    assert "v.breathing" in found.frf.responses


def test_least_squares_averages_channels() -> None:
    """Independent errors of nine channels: six motions know them to σ² (RᵀR)⁻¹."""
    rng = np.random.default_rng(1)
    q = rng.standard_normal(6)
    noise = rng.standard_normal((20_000, 9))
    spread = np.cov(U.to_motions() @ (U.matrix @ q + noise).T)
    np.testing.assert_allclose(spread, np.linalg.inv(U.matrix.T @ U.matrix), rtol=0.2, atol=0.5)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"channels": SENSORS[:5]}, "5 channels for 6 motions"),
        ({"channels": SENSORS[:6]}, "do not tell"),
        ({"motions": ("x", "roll")}, "motion 'roll'"),
        ({"weights": [1.0, -1.0]}, "9 positive numbers"),
    ],
)
def test_points_that_are_none(given: dict[str, object], words: str) -> None:
    both: dict[str, object] = {"name": "v", "channels": SENSORS, "point": POINT}
    with pytest.raises(FbsError, match=words):
        VirtualPoint(**(both | given)).to_motions()  # type: ignore[arg-type]


def test_channels_that_are_none() -> None:
    with pytest.raises(FbsError, match="length 2"):
        Channel("a", (0.0, 0.0, 0.0), (2.0, 0.0, 0.0))
    with pytest.raises(FbsError, match="'s1x' is not among the FRF's responses"):
        transform(body().select(["far"]), [U])
