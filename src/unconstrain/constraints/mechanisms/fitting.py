"""Shapes fitted to points by least squares of the distances; points that are far from a shape hardly count.

A point lies on the shape, with Gaussian noise across it, or anywhere within the extent of the movement: a mixture of
two densities. Its weights and the shape are found by turns, expectation maximisation.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from unconstrain.constraints.mechanisms.shapes import Kind, Shape

Array = NDArray[np.float64]

TURNS, SETTLED = 12, 1e-3
STEPS, TRIES, CONVERGED = 50, 8, 1e-6
LEAST_STIFF, LEAST_DAMPING = 1e-6, 1e-6
"""Parameters that change nothing, as the radius of a straight arc, are held by this share of the others."""
LARGEST_RADIUS = 20.0
"""In extents of the movement: an arc of three degrees. What is less curved is straight."""
LEAST_OUTSIDE, MOST_OUTSIDE = 0.01, 0.1
"""Shares of the points that are not on the shape."""
LEAST_POINTS = 8


@dataclass(frozen=True)
class Fit:
    """A shape at one place or at several, and how much of the points lies on it.

    Parameters
    ----------
    shapes : tuple of Shape
        With one direction and one radius.
    outside : float
        Share of the points that is not on the shape.
    """

    shapes: tuple[Shape, ...]
    outside: float

    def log_density(self, P: Array, place: int, noise: float, extent: float) -> Array:
        """Compute the logarithm of the density of points.

        Along the shape it is even over the extent of the movement, across it normal.

        Parameters
        ----------
        P : ndarray of shape (N, d)
            Points.
        place : int
            Which of the shapes.
        noise, extent : float
            In the unit of the points.

        Returns
        -------
        ndarray of shape (N,)
        """
        return np.logaddexp(*self._parts(P, place, noise, extent))

    def on_shape(self, P: Array, place: int, noise: float, extent: float) -> Array:
        """Compute the probability that points lie on the shape.

        Parameters
        ----------
        P : ndarray of shape (N, d)
            Points.
        place : int
            Which of the shapes.
        noise, extent : float
            In the unit of the points.

        Returns
        -------
        ndarray of shape (N,)
        """
        on, _ = self._parts(P, place, noise, extent)
        return np.exp(on - self.log_density(P, place, noise, extent))

    def _parts(self, P: Array, place: int, noise: float, extent: float) -> tuple[Array, Array]:
        r = self.shapes[place].residuals(P)
        d, k = P.shape[1], r.shape[1]
        across = -0.5 * np.sum((r / noise) ** 2, axis=1) - k * np.log(np.sqrt(2.0 * np.pi) * noise)
        on = np.log1p(-self.outside) + across - (d - k) * np.log(extent)
        return on, np.full(len(P), np.log(self.outside) - d * np.log(extent))


def fit_shape(kind: Kind, places: Sequence[Array], noise: float, extent: float) -> Fit | None:
    """Fit a shape of one kind to points at one place or at several, with one direction and one radius.

    Parameters
    ----------
    kind : {"prismatic", "hinge", "plane", "sphere", "cylinder"}
        Which.
    places : sequence of ndarray of shape (N, d)
        Points of two or three dimensions at each place. Only a line and a hinge may have several.
    noise, extent : float
        In the unit of the points.

    Returns
    -------
    Fit or None
        None where there are too few points, or the shape could not be told from a straight one.
    """
    if min(map(len, places)) < LEAST_POINTS:
        return None
    weights = [np.ones(len(P)) for P in places]
    shapes: tuple[Shape, ...] | None = None
    outside = LEAST_OUTSIDE
    for _ in range(TURNS):
        shapes = _fit_weighted(kind, places, weights, extent, shapes)
        if shapes is None:
            return None
        fit = Fit(shapes, outside)
        new = [fit.on_shape(P, place, noise, extent) for place, P in enumerate(places)]
        moved = max(np.abs(after - before).max() for after, before in zip(new, weights, strict=True))
        outside = float(np.clip(1.0 - np.mean(np.concatenate(new)), LEAST_OUTSIDE, MOST_OUTSIDE))
        # A point is never let go of for good: at first the shape may be off by many noises.
        weights = [np.maximum(on, 1e-3) for on in new]
        if moved < SETTLED:
            break
    assert shapes is not None
    return Fit(shapes, outside)


def _fit_weighted(
    kind: Kind,
    places: Sequence[Array],
    weights: Sequence[Array],
    extent: float,
    before: tuple[Shape, ...] | None,
) -> tuple[Shape, ...] | None:
    means = [w @ P / w.sum() for P, w in zip(places, weights, strict=True)]
    roots = [np.sqrt(w)[:, None] for w in weights]
    if kind in ("prismatic", "plane"):
        centred = [root * (P - mean) for P, mean, root in zip(places, means, roots, strict=True)]
        directions = np.linalg.svd(np.concatenate(centred), full_matrices=False)[2]
        direction = _upright(directions[0 if kind == "prismatic" else -1])
        return tuple(Shape(kind, mean, direction) for mean in means)
    starts = [before] if before is not None else _starts(kind, places, roots)
    best, least = None, np.inf
    for start in starts:
        shapes, cost = _refine(start, places, roots, extent)
        if cost < least:
            best, least = shapes, cost
    return best if best is not None and best[0].radius < LARGEST_RADIUS * extent else None


def _starts(kind: Kind, places: Sequence[Array], roots: Sequence[Array]) -> list[tuple[Shape, ...]]:
    """Make shapes that algebra finds: a sphere, circles about principal directions."""
    if len(places) > 1:
        return [
            _common([_starts(kind, [P], [root])[0][0] for P, root in zip(places, roots, strict=True)], places)
        ]
    P, root = places[0], roots[0]
    d = P.shape[1]
    if kind == "sphere" or d == 2:
        centre, radius = _algebraic(P, root)
        return [(Shape(kind, centre, np.zeros(d), radius),)]
    mean = P.mean(axis=0)
    directions = np.linalg.svd(root * (P - mean), full_matrices=False)[2]
    shapes: list[tuple[Shape, ...]] = []
    for axis in directions[[2]] if kind == "hinge" else directions:
        plane = np.linalg.svd(axis[None])[2][1:]
        centre, radius = _algebraic((P - mean) @ plane.T, root)
        shapes.append((Shape(kind, mean + centre @ plane, axis, radius),))
    return shapes


def _common(own: Sequence[Shape], places: Sequence[Array]) -> tuple[Shape, ...]:
    """Make hinges of one direction and one radius of those of each place."""
    axes = np.array([shape.direction for shape in own])
    axis = np.linalg.eigh(axes.T @ axes)[1][:, -1] if axes.any() else axes[0]
    radius = float(np.median([shape.radius for shape in own]))
    shapes = []
    for shape, P in zip(own, places, strict=True):
        middle = P.mean(axis=0)
        outward = _outward(middle - shape.point, axis)
        shapes.append(Shape(shape.kind, middle - radius * outward, axis, radius))
    return tuple(shapes)


def _algebraic(Q: Array, root: Array) -> tuple[Array, float]:
    """Solve ``|q|² = 2 c·q + r² - |c|²`` for centre and radius."""
    middle = Q.mean(axis=0)
    Q = Q - middle
    A = np.concatenate([2.0 * Q, np.ones((len(Q), 1))], axis=1)
    solution = np.linalg.lstsq(root * A, root[:, 0] * np.sum(Q**2, axis=1), rcond=None)[0]
    centre = solution[:-1]
    return centre + middle, float(np.sqrt(max(solution[-1] + centre @ centre, 1e-300)))


def _refine(
    shapes: tuple[Shape, ...], places: Sequence[Array], roots: Sequence[Array], extent: float
) -> tuple[tuple[Shape, ...] | None, float]:
    """Minimise the squares of the distances by the method of Levenberg and Marquardt, from a start near enough."""

    def distances(shapes: tuple[Shape, ...]) -> Array:
        return np.concatenate(
            [
                np.ravel(root * shape.residuals(P))
                for shape, P, root in zip(shapes, places, roots, strict=True)
            ]
        )

    damping, r = 1e-3, distances(shapes)
    cost = float(r @ r)
    for _ in range(STEPS):
        if not shapes[0].radius < 10.0 * LARGEST_RADIUS * extent:
            return None, np.inf
        J, move = _linearize(shapes, places, roots, extent)
        H, g = J.T @ J, J.T @ r
        scale = np.diag(np.diag(H) + LEAST_STIFF * np.trace(H))
        for _ in range(TRIES):
            step = np.linalg.lstsq(H + damping * scale, -g, rcond=None)[0]
            new = move(np.asarray(step, dtype=np.float64))
            r_new = distances(new)
            cost_new = float(r_new @ r_new)
            if cost_new < cost:
                break
            damping *= 10.0
        else:
            break
        gained, shapes, r, cost, damping = (
            cost - cost_new,
            new,
            r_new,
            cost_new,
            max(damping / 10.0, LEAST_DAMPING),
        )
        if gained <= CONVERGED * cost:
            break
    upright = _upright(shapes[0].direction)
    fitted = [
        replace(shape, point=_on_axis(shape, P), direction=upright)
        for shape, P in zip(shapes, places, strict=True)
    ]
    return tuple(fitted), cost


def _linearize(
    shapes: tuple[Shape, ...], places: Sequence[Array], roots: Sequence[Array], extent: float
) -> tuple[Array, Callable[[Array], tuple[Shape, ...]]]:
    """Compute the derivatives of all residuals, and the function that moves the shapes by parameters.

    Parameters are the tilt of the direction, the logarithm of the radius, and where each arc lies, rather than its
    centre: well behaved where the arc is nearly straight.
    """
    axis, radius, d = shapes[0].direction, shapes[0].radius, len(shapes[0].direction)
    tangents = np.linalg.svd(axis[None])[2][1:] if axis.any() else np.zeros((0, d))
    moves = extent * (tangents if shapes[0].kind == "cylinder" else np.eye(d))
    middles = [_outward(P.mean(axis=0) - shape.point, axis) for shape, P in zip(shapes, places, strict=True)]
    common, own, n = len(tangents) + 1, len(moves), len(shapes)
    parts = []
    for place, (shape, P, root, middle) in enumerate(zip(shapes, places, roots, middles, strict=True)):
        rows = shape.rows(P)
        by_axis = -((P - shape.point) @ axis)[:, None, None] * rows
        by_radius = np.full((*rows.shape[:2], 1), -1.0)
        if shape.kind == "hinge" and axis.any():
            by_axis[:, 0], by_radius[:, 0] = P - shape.point, 0.0
        J = np.zeros((*rows.shape[:2], common + n * own))
        J[:, :, : common - 1] = by_axis @ tangents.T
        J[:, :, common - 1 : common] = radius * (rows @ middle[:, None] + by_radius)
        J[:, :, common + place * own : common + (place + 1) * own] = -rows @ moves.T
        parts.append((root[:, :, None] * J).reshape(-1, J.shape[2]))

    def move(step: Array) -> tuple[Shape, ...]:
        turned = axis + step[: common - 1] @ tangents
        norm = np.linalg.norm(turned)
        size = float(radius * np.exp(np.clip(step[common - 1], -2.0, 2.0)))
        shifts = step[common:].reshape(n, own) @ moves
        return tuple(
            Shape(
                shape.kind,
                shape.point + shift - (size - radius) * middle,
                turned / norm if norm > 0 else turned,
                size,
            )
            for shape, shift, middle in zip(shapes, shifts, middles, strict=True)
        )

    return np.concatenate(parts), move


def _outward(away: Array, axis: Array) -> Array:
    """Compute the unit vector from an axis, zero on it."""
    across = away - (away @ axis) * axis
    length = np.linalg.norm(across)
    return across / length if length > 0 else across


def _on_axis(shape: Shape, P: Array) -> Array:
    """Choose of a cylinder's axis the point beside the middle of the points."""
    if shape.kind != "cylinder":
        return shape.point
    return shape.point + ((P.mean(axis=0) - shape.point) @ shape.direction) * shape.direction


def _upright(direction: Array) -> Array:
    """Make the largest entry positive: a direction and its negative are the same line."""
    return direction * (np.sign(direction[np.argmax(np.abs(direction))]) or 1.0)
