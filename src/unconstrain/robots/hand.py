"""A policy of a hand, learnt from the joints that move it.

Where contact acts, it takes away joint motion along the row `nᵀJ(q)` of the hand's Jacobian. So the policy that is
learnt has to be one over joints. A person who guides an arm has the hand in mind, though, and what they want of it
depends on where it is:

    π(q) = J⁺(q) v + (I - J⁺J)(r + s ∘ q),    v = W b(p(q)),

with p the hand's position, b any basis of it, and the last term a pull on the posture that leaves the hand alone. It is
linear in W, r and s. An observation along a direction e of joint space has the features
`((J⁺ᵀe) ⊗ b, Ne, Ne ∘ q)`, `N = I - J⁺J`: 3 M + 2 n parameters for a policy of n joints.
"""

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, clone

from unconstrain.errors import PolicyError
from unconstrain.robots.robot import Robot

if TYPE_CHECKING:
    from unconstrain.deploy.compiled import CompiledPolicy

Array = NDArray[np.float64]

DAMPING = 1e-9
"""Added to `J Jᵀ`, as a share of its trace, so that J⁺ stays finite in singular postures."""

BLOCKS = 256
"""How many blocks of postures are kept with their kinematics: a fit comes by the same ones many times."""


class HandFeatures(BaseEstimator):
    """The features of `π(q) = J⁺(q) W b(p(q)) + (I - J⁺J)(r + s ∘ q)`: of a hand's velocity, and a pull on the posture.

    States are joint positions and actions joint velocities, both in the order of `robot.joints`. Contact is inferred
    in joint space, or given by `constraints.from_normals` or `from_forces` with the Jacobian. A policy of them
    holds the robot, which files do not: save what `hand` returns.

    Parameters
    ----------
    robot : Robot
        Whose joints were recorded.
    frame : str
        The hand: one of `robot.frames`.
    transformer : scikit-learn transformer
        The basis b of positions (N, 3) in metres: `NormalizedRBF(15)`, for example. It is cloned, never changed.

    Attributes
    ----------
    basis_ : transformer
        The fitted copy.

    Raises
    ------
    PolicyError
        In `fit`, if states or actions are not one for each joint.

    Examples
    --------
    >>> features = HandFeatures(panda, "panda_hand_tcp", uc.NormalizedRBF(15))          # doctest: +SKIP
    >>> policy = uc.ParametricPolicy(features).fit(demos)                               # doctest: +SKIP
    >>> step = policy.features_.hand(policy.weights_)       # position to velocity      # doctest: +SKIP
    """

    def __init__(self, robot: Robot, frame: str, transformer: Any):
        self.robot = robot
        self.frame = frame
        self.transformer = transformer

    def __sklearn_clone__(self) -> "HandFeatures":
        """Share the robot, which does not change."""
        return type(self)(self.robot, self.frame, clone(self.transformer))

    def fit(self, X: Array, d: int) -> "HandFeatures":
        """Fit the basis to where the hand was.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            Joint positions.
        d : int
            Dimension of the actions, n as well.

        Returns
        -------
        self
            Fitted.

        Raises
        ------
        PolicyError
            If states or actions are not one for each joint.
        """
        n = self.robot.n
        if X.shape[1] != n or d != n:
            raise PolicyError(
                f"HandFeatures needs a state and an action for each of the robot's {n} joints, got {X.shape[1]} states "
                f"and {d} actions: give {', '.join(self.robot.joints)}, or lock the joints that were not recorded"
            )
        self.basis_ = clone(self.transformer).fit(self.robot.pose(X, self.frame)[0])
        return self

    def along(self, X: Array, directions: Array) -> Array:
        """Compute the features along one direction at each posture.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            Joint positions.
        directions : ndarray of shape (N, n)
            In joint space, of any length.

        Returns
        -------
        ndarray of shape (N, 3 M + 2 n)
            V, with `V w = eᵀπ(q)`.
        """
        places, J, inverse = self._kinematics(X)
        pulls = np.einsum("nji,nj->ni", inverse, directions)
        hand = pulls[:, :, None] * self.basis_.transform(places)[:, None]
        # N is symmetric, so that Ne = e - Jᵀ J⁺ᵀ e.
        still = directions - np.einsum("nij,ni->nj", J, pulls)
        return np.concatenate([hand.reshape(len(X), -1), still, still * X], axis=1)

    def evaluate(self, X: Array, w: Array) -> Array:
        """Evaluate the policy.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            Joint positions.
        w : ndarray of shape (3 M + 2 n,)
            Parameters.

        Returns
        -------
        ndarray of shape (N, n)
            Joint velocities.
        """
        places, J, inverse = self._kinematics(X)
        W, offset, slope = self._split(w)
        pull = offset + slope * X
        wanted = self.basis_.transform(places) @ W.T - np.einsum("nij,nj->ni", J, pull)
        return pull + np.einsum("nij,nj->ni", inverse, wanted)

    def hand(self, w: Array) -> "CompiledPolicy":
        """Compile the hand's part, for a controller that knows the arm and its limits.

        Parameters
        ----------
        w : ndarray of shape (3 M + 2 n,)
            Parameters.

        Returns
        -------
        CompiledPolicy
            `v = W b(p)`, from positions (3,) in metres to velocities (3,).

        Raises
        ------
        PolicyError
            If the transformer cannot be compiled.
        """
        if not hasattr(self.basis_, "compile"):
            raise PolicyError(
                f"a hand's policy of {type(self.basis_).__name__} cannot be compiled: use NormalizedRBF"
            )
        return self.basis_.compile(self._split(w)[0])

    def posture(self, w: Array) -> tuple[Array, Array]:
        """Return the pull on the posture, `r + s ∘ q`.

        Parameters
        ----------
        w : ndarray of shape (3 M + 2 n,)
            Parameters.

        Returns
        -------
        offset : ndarray of shape (n,)
            The part r that is the same everywhere.
        slope : ndarray of shape (n,)
            How each joint's pull changes with its position, s.
        """
        return self._split(w)[1:]

    def _split(self, w: Array) -> tuple[Array, Array, Array]:
        n = self.robot.n
        return w[: -2 * n].reshape(3, -1), w[-2 * n : -n], w[-n:]

    def _kinematics(self, X: Array) -> tuple[Array, Array, Array]:
        return _kinematics(self.robot, self.frame, np.ascontiguousarray(X, dtype=np.float64).tobytes())


@lru_cache(maxsize=BLOCKS)
def _kinematics(robot: Robot, frame: str, postures: bytes) -> tuple[Array, Array, Array]:
    """Compute the hand's positions (N, 3), its Jacobians (N, 3, n) and their inverses (N, n, 3)."""
    Q = np.frombuffer(postures).reshape(-1, robot.n)
    J = robot.jacobian(Q, frame)[:, :3]
    square = J @ J.swapaxes(1, 2)
    damping = DAMPING * np.trace(square, axis1=1, axis2=2)
    inverse = J.swapaxes(1, 2) @ np.linalg.inv(square + damping[:, None, None] * np.eye(3))
    return robot.pose(Q, frame)[0], J, inverse
