"""With what, where and when a report was made."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version

PACKAGES = ("drivetrain-crosscheck", "exudyn", "numpy", "scipy", "matplotlib")


@dataclass(frozen=True)
class Provenance:
    """Versions by name, the platform, and the date (UTC, ISO 8601)."""

    versions: Mapping[str, str]
    platform: str
    date: str


def provenance() -> Provenance:
    """What this report is made with, now."""
    return Provenance(
        versions={
            **{package: _version(package) for package in PACKAGES},
            "python": platform.python_version(),
        },
        platform=platform.platform(),
        date=datetime.now(UTC).isoformat(timespec="seconds"),
    )


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed (run from source)"
