"""Rotations, however they are written."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.arrays import check_choice
from unconstrain.spaces.base import Array, Space
from unconstrain.spaces.words import FRAMES

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation as Rotations

WRITTEN = {"xyzw": 4, "wxyz": 4, "rotvec": 3, "euler": 3, "matrix": 9}
"""How rotations may be written, and in how many numbers."""

NEAR = np.radians(150)
"""Rotations that lie within this angle of their mean are laid out as rotation vectors; others as matrices."""

# By how much the norm of a recorded quaternion or of a matrix's rows may be from 1.
UNIT = 0.1

WORDS = {
    "xyzw": "quaternions (x, y, z, w)",
    "wxyz": "quaternions (w, x, y, z)",
    "rotvec": "rotation vectors",
    "euler": "roll, pitch and yaw about fixed axes",
    "matrix": "rotation matrices, row by row",
}


@dataclass(frozen=True)
class Rotation(Space):
    """A rotation in space; velocities are angular velocities ω, in radians a second.

    With ω in the world's frame `Ṙ = [ω] R`, in the body's `Ṙ = R [ω]`. Both signs of a quaternion are one rotation.

    Parameters
    ----------
    written : {"xyzw", "wxyz", "rotvec", "euler", "matrix"}
        How it is written: a quaternion, a rotation vector, roll, pitch and yaw (about fixed axes x, y, z in turn), or a
        matrix row by row.
    frame : {"world", "body"}
        That angular velocities are in.
    degrees : bool
        Whether rotation vectors or roll, pitch and yaw are in degrees. Velocities are in radians all the same.

    Raises
    ------
    UnconstrainError
        It is written in another way, or the frame is another.
    """

    written: str = "xyzw"
    frame: str = "world"
    degrees: bool = False

    def __post_init__(self) -> None:
        check_choice(self.written, "how a rotation is written", tuple(WRITTEN))
        check_choice(self.frame, "the frame of angular velocities", FRAMES)

    @property
    def n_states(self) -> int:
        """How many numbers stand for a rotation."""
        return WRITTEN[self.written]

    @property
    def n_actions(self) -> int:
        """Three: the angular velocity."""
        return 3

    @property
    def origin(self) -> Array:
        """No rotation."""
        from scipy.spatial.transform import Rotation as Rotations

        return self.write(Rotations.identity(1))[0]

    @property
    def units(self) -> tuple[str, ...]:
        """Radians."""
        return ("rad",) * 3

    @property
    def words(self) -> str:
        """What states are, for a note."""
        unit = " in degrees" if self.degrees and self.written in ("rotvec", "euler") else ""
        return f"{WORDS[self.written]}{unit}"

    def describe(self) -> dict[str, Any]:
        """Say what it is in plain values; see `Space.describe`."""
        return {"rotation": self.written, "frame": self.frame, "degrees": self.degrees}

    def action_names(self, names: Sequence[str]) -> tuple[str, ...]:
        """Name the angular velocity after what the names share; see `Space.action_names`."""
        stem = names[0][: max(map(names[0].rfind, "._/")) + 1]
        if not all(name.startswith(stem) for name in names):
            stem = ""
        return tuple(f"{stem}omega_{axis}" for axis in "xyz")

    def faults(self, X: Array) -> NDArray[np.bool_]:
        """Find rows that are no rotation; see `Space.faults`."""
        if self.written in ("rotvec", "euler"):
            return np.zeros(len(X), dtype=bool)
        if self.written == "matrix":
            R = X.reshape(-1, 3, 3)
            apart = np.abs(R @ R.swapaxes(1, 2) - np.eye(3)).max(axis=(1, 2))
            return (apart > 2 * UNIT) | (np.linalg.det(R) <= 0)
        return np.abs(np.linalg.norm(X, axis=1) - 1.0) > UNIT

    def rotations(self, X: Array) -> "Rotations":
        """Read rotations.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States; quaternions and matrices of any scale but zero.

        Returns
        -------
        scipy.spatial.transform.Rotation
            N rotations.
        """
        from scipy.spatial.transform import Rotation as Rotations

        X = np.require(X, requirements="W")  # scipy takes no others
        if self.written == "rotvec":
            return Rotations.from_rotvec(X, degrees=self.degrees)
        if self.written == "euler":
            return Rotations.from_euler("xyz", X, degrees=self.degrees)
        if self.written == "matrix":
            return Rotations.from_matrix(X.reshape(-1, 3, 3))
        return Rotations.from_quat(X, scalar_first=self.written == "wxyz")

    def write(self, rotations: "Rotations", near: Array | None = None) -> Array:
        """Write rotations.

        Parameters
        ----------
        rotations : scipy.spatial.transform.Rotation
            N rotations.
        near : ndarray of shape (N, n), optional
            States near them: quaternions get the sign of these.

        Returns
        -------
        ndarray of shape (N, n)
            States.
        """
        if self.written == "rotvec":
            return rotations.as_rotvec(degrees=self.degrees)
        if self.written == "euler":
            return rotations.as_euler("xyz", degrees=self.degrees)
        if self.written == "matrix":
            return rotations.as_matrix().reshape(-1, 9)
        q = rotations.as_quat(scalar_first=self.written == "wxyz")
        if near is not None:
            q = np.where(np.sum(q * near, axis=1, keepdims=True) < 0, -q, q)
        return q

    def difference(self, X: Array, Y: Array) -> Array:
        """Compute the rotation vector of the shortest turn; see `Space.difference`."""
        a, b = self.rotations(X), self.rotations(Y)
        return (b * a.inv() if self.frame == "world" else a.inv() * b).as_rotvec()

    def step(self, X: Array, U: Array, dt: float | Array) -> Array:
        """Turn by `dt ω`; see `Space.step`."""
        from scipy.spatial.transform import Rotation as Rotations

        turn, at = Rotations.from_rotvec(dt * U), self.rotations(X)
        return self.write(turn * at if self.frame == "world" else at * turn, X)

    def follow(self, X: Array) -> Array:
        """Give quaternions the sign of the one before; see `Space.follow`."""
        if self.n_states != 4:
            return X
        turned = np.sum(X[1:] * X[:-1], axis=1) < 0
        signs = np.where(np.cumsum(np.append(False, turned)) % 2, -1.0, 1.0)
        return X * signs[:, None]

    def coordinates(self, X: Array) -> Array:
        """Return unit quaternions (x, y, z, w) that follow each other; see `Space.coordinates`."""
        return QUATERNION.follow(self.rotations(X).as_quat())

    def velocity(self, C: Array, slopes: Array) -> Array:
        """Compute `ω = 2 q̇ q*`, or `2 q* q̇` in the body's frame; see `Space.velocity`."""
        v, w = C[:, :3], C[:, 3:]
        dv, dw = slopes[:, :3], slopes[:, 3:]
        side = 1.0 if self.frame == "world" else -1.0
        # Quaternions between samples are shorter than 1 by what smoothing takes.
        return 2.0 * (w * dv - dw * v + side * np.cross(v, dv)) / np.sum(C**2, axis=1, keepdims=True)

    def relative(self, X: Array, to: Array) -> Array:
        """Compute `R_toᵀ R`; see `Space.relative`."""
        return self.write(self.rotations(to).inv() * self.rotations(X))

    def absolute(self, X: Array, to: Array) -> Array:
        """Compute `R_to R`; see `Space.absolute`."""
        return self.write(self.rotations(to) * self.rotations(X))

    def relative_velocity(self, X: Array, U: Array, to: Array, moves: Array) -> Array:
        """Compute `R_toᵀ (ω - ω_to)`, or `ω - Rᵀ R_to ω_to` in the body's frame; see `Space.relative_velocity`."""
        frame = self.rotations(to)
        if self.frame == "world":
            return frame.inv().apply(U - moves)
        return U - (self.rotations(X).inv() * frame).apply(moves)

    def absolute_velocity(self, U: Array, to: Array) -> Array:
        """Compute `R_to ω`, or ω in the body's frame; see `Space.absolute_velocity`."""
        return self.rotations(to).apply(U) if self.frame == "world" else U

    def find_base(self, X: Array) -> Array | None:
        """Find the mean rotation, None where others are all but opposite to it; see `Space.find_base`."""
        rotations = self.rotations(X)
        mean = rotations.mean()
        if float(np.max((mean.inv() * rotations).magnitude())) > NEAR:
            return None
        return self.write(mean)[0] if self.written == "matrix" else np.ravel(self.write(mean))

    def embed(self, X: Array, base: Array | None) -> Array:
        """Lay rotations out as rotation vectors from the base, or as matrices; see `Space.embed`."""
        # Vectors are in the frame of the velocities: that of one near zero is ω. Matrices are scaled, so that what is
        # near lies as far apart as the angle is.
        if base is not None:
            return self.difference(np.tile(base, (len(X), 1)), X)
        return self.rotations(X).as_matrix().reshape(-1, 9) / np.sqrt(2.0)


QUATERNION = Rotation()
