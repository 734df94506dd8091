"""A person's fingertip on a flat and on a curved surface: the surfaces found in the motion alone."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reproduction.recordings import CURVED, FLAT, surface_file
from unconstrain import metrics
from unconstrain.arrays import BLOCKED
from unconstrain.constraints.learnt import ConstantConstraint, FeatureConstraint
from unconstrain.constraints.learnt.base import held_out_projections
from unconstrain.demonstrations import Demonstrations
from unconstrain.features import NormalizedRBF
from unconstrain.fitting.solve import splits
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy
from unconstrain.recordings import load

Array = NDArray[np.float64]

BLOCKS = 10
CENTERS = (5, 10, 15, 20, 25)


@dataclass(frozen=True)
class PolicyErrors:
    """Errors of one policy on held-out blocks, as shares of the actions' variance.

    Attributes
    ----------
    model, way : str
        Which model, and whether it was learnt with the learnt constraint or without.
    along, constrained : float
        Along the recorded action alone, and of the whole action under the learnt constraint.
    """

    model: str
    way: str
    along: float
    constrained: float


@dataclass(frozen=True)
class Surfaces:
    """Both recordings, the flat one's normal, and the held-out errors of everything tried.

    Attributes
    ----------
    flat, curved : Demonstrations
        Recorded fingertips.
    normal, plane : ndarray of shape (3,)
        The direction hardly moved in, and the normal of the plane through the points, on the flat surface.
    angle, uncertainty : float
        Between the two, and the standard error of the first, in degrees.
    shares : ndarray of shape (3,)
        Of the motion on the flat surface along each direction.
    flat_errors, curved_errors : dict of str to float
        nPOE on held-out blocks by kind of constraint.
    policies : dict of str to list of PolicyErrors
        By surface.
    best : int
        Number of RBFs with the least error on the curved surface.
    """

    flat: Demonstrations
    curved: Demonstrations
    normal: Array
    plane: Array
    angle: float
    uncertainty: float
    shares: Array
    flat_errors: dict[str, float]
    curved_errors: dict[str, float]
    policies: dict[str, list[PolicyErrors]]
    best: int


def load_surfaces(folder: Path) -> tuple[Demonstrations, Demonstrations]:
    """Load the flat and the curved recording from a folder. Raises `UnconstrainError` where they are not there."""
    flat, curved = (
        load(
            surface_file(folder, name),
            state=[1, 2, 3],
            time="rosbagTimestamp",
            max_speed=1,
            min_duration=1,
        )
        for name in (FLAT, CURVED)
    )
    return flat, curved


def learn_surfaces(folder: Path) -> Surfaces:
    """Learn the constraints of both surfaces, and judge them on blocks held out."""
    flat, curved = load_surfaces(folder)
    constant = ConstantConstraint(1).fit(flat.states, flat.actions, groups=flat.blocks(BLOCKS))
    plane = np.linalg.svd(flat.states - flat.states.mean(axis=0), full_matrices=False)[2][-1]
    angle = np.degrees(np.arccos(min(1.0, abs(float(plane @ constant.rows_[0])))))
    curves = {f"{n} RBFs": _measure_npoe(FeatureConstraint(NormalizedRBF(n)), curved) for n in CENTERS}
    best = CENTERS[int(np.argmin(list(curves.values())))]
    return Surfaces(
        flat,
        curved,
        constant.rows_[0],
        plane,
        float(angle),
        float(np.degrees(constant.uncertainty_)),
        constant.shares_,
        {
            "constant row": _measure_npoe(ConstantConstraint(1), flat),
            "plane through the points": _npoe(flat.actions, np.eye(3) - np.outer(plane, plane)),
        },
        {"constant row": _measure_npoe(ConstantConstraint(1), curved)} | curves,
        {
            "flat": _measure_policies(ConstantConstraint(1), flat),
            "curved": _measure_policies(FeatureConstraint(NormalizedRBF(best)), curved),
        },
        best,
    )


def _npoe(U: Array, N: Array) -> float:
    N = np.broadcast_to(N, (len(U), *N.shape[-2:]))
    return metrics.normalized(metrics.projected_observation_error(U, N), U)


def _measure_npoe(estimator: Any, D: Demonstrations) -> float:
    """Measure the nPOE on held-out blocks of constraints learnt from the others."""
    return _npoe(D.actions, held_out_projections(estimator, D.states, D.actions, D.blocks(BLOCKS)))


def _find_known(projections: Array, U: Array) -> Array:
    """Take a learnt projection for unknown, NaN, where it blocks much of the action that was recorded under it.

    The constraint is wrong there, and the library refuses such projections.
    """
    blocked = np.linalg.norm(U - np.einsum("nij,nj->ni", projections, U), axis=1)
    return np.where((blocked > BLOCKED * np.linalg.norm(U, axis=1))[:, None, None], np.nan, projections)


def _measure_policies(estimator: Any, D: Demonstrations) -> list[PolicyErrors]:
    """Measure policies on held-out blocks, learnt with and without the learnt projections."""
    blocks = D.blocks(BLOCKS)
    models = {
        "local models": LocallyLinearPolicy(n_centers=20, risk="inconsistency", alpha="cv"),
        "RBFs": ParametricPolicy(NormalizedRBF(25), risk="inconsistency", alpha="cv"),
    }
    result = []
    for model, policy in models.items():
        for way in ("inconsistency", "learnt constraint"):
            P, N = np.empty_like(D.actions), np.empty((len(D), 3, 3))
            for train, test in splits(len(D), blocks):
                X, U, groups = D.states[train], D.actions[train], blocks[train]
                learnt = estimator.fit(X, U, groups=groups)
                known = _find_known(learnt.predict(X), U) if way == "learnt constraint" else None
                P[test] = policy.fit(X, U, groups=groups, projections=known).predict(D.states[test])
                N[test] = learnt.predict(D.states[test])
            left = np.einsum("nij,nj->ni", N, D.actions - P)
            result.append(
                PolicyErrors(
                    model,
                    way,
                    along=metrics.normalized(metrics.inconsistency(D.actions, P), D.actions),
                    constrained=metrics.normalized(float(np.mean(np.sum(left**2, axis=1))), D.actions),
                )
            )
    return result
