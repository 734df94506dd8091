"""Contact and its constraint are read off measured forces, through noise, spikes and friction."""

import numpy as np

from unconstrain import constraints


def slide(noise=0.0, friction=0.0, seed=0, samples=400):
    """A fingertip that lands on a tilted plane, slides in it, and leaves: actions, forces, normal, contact."""
    rng = np.random.default_rng(seed)
    normal = np.array([0.2, -0.3, 0.9])
    normal /= np.linalg.norm(normal)
    on = (np.arange(samples) % 100 > 20) & (np.arange(samples) % 100 < 80)
    U = rng.normal(size=(samples, 3))
    U[on] -= (U[on] @ normal)[:, None] * normal
    unit = U / np.linalg.norm(U, axis=1, keepdims=True)
    forces = np.where(on[:, None], 5.0 * normal - 5.0 * friction * unit, 0.0) + noise * rng.normal(
        size=(samples, 3)
    )
    return U, forces, normal, on


def test_forces_tell_contact_through_noise_spikes_and_friction():
    U, forces, normal, on = slide(noise=0.3, friction=0.4)
    forces[10] = 40.0  # a spike in free motion
    touching, _ = constraints.contact(forces, 2.0)
    np.testing.assert_array_equal(touching == 1, on)
    N = constraints.from_forces(forces, 2.0, actions=U)
    np.testing.assert_array_equal(N[~on], np.broadcast_to(np.eye(3), N[~on].shape))
    rows = np.linalg.svd(np.eye(3) - N[on])[2][:, 0]
    assert np.degrees(np.median(np.arccos(np.abs(rows @ normal)))) < 5
    # With friction taken out, what moved was free to move: no sample contradicts its own projection.
    moved = on & (np.linalg.norm(U, axis=1) > 0.5)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", N[moved], U[moved]), U[moved], atol=1e-9)


def test_forces_without_noise_are_exact_and_filtering_never_crosses_an_edge():
    _, forces, normal, on = slide()
    N = constraints.from_forces(forces, 2.0)
    expected = constraints.projection(np.where(on[:, None], normal, 0.0)[:, None])
    np.testing.assert_allclose(N, expected, atol=1e-12)


def test_what_is_said_of_an_episode_does_not_depend_on_the_others():
    """Or a stream, which sees a few at a time, could not say the same."""
    slides = [slide(noise=0.3, friction=0.4, seed=seed, samples=130 + 20 * seed) for seed in range(3)]
    U = np.concatenate([10.0**seed * each[0] for seed, each in enumerate(slides)])
    forces = np.concatenate([each[1] for each in slides])
    episodes = np.repeat([2, 0, 1], [len(each[0]) for each in slides])
    together = constraints.from_forces(forces, 2.0, actions=U, episodes=episodes, margin=2)
    for label in range(3):
        own = episodes == label
        alone = constraints.from_forces(forces[own], 2.0, actions=U[own], margin=2)
        np.testing.assert_array_equal(together[own], alone)


def test_what_could_be_contact_or_not_is_unknown():
    size = np.array([0, 0, 1.5, 1.5, 0, 0, 1.5, 3, 3, 1.5, 0, 0], dtype=float)
    touching, _ = constraints.contact(size[:, None] * [[0.0, 1.0]], 2.0, window=1)
    np.testing.assert_array_equal(touching, [0, 0, np.nan, np.nan, 0, 0, 1, 1, 1, 1, 0, 0])
    pushed_along = np.tile([[5.0, 0.1]], (12, 1))
    assert np.isnan(constraints.from_forces(pushed_along, 2.0, actions=np.tile([[1.0, 0.0]], (12, 1)))).all()
    near = constraints.from_forces(size[:, None] * [[0.0, 1.0]], 2.0, window=1, margin=1)
    assert np.isnan(near[[5, 6, 9, 10]]).all()
    assert not np.isnan(near[[0, 7, 8, 11]]).any()
    # Two episodes are not filtered into each other.
    touching, _ = constraints.contact([[0.0, 5.0]] * 3 + [[0.0, 0.0]] * 3, 2.0, episodes=[0, 0, 0, 1, 1, 1])
    np.testing.assert_array_equal(touching, [1, 1, 1, 0, 0, 0])
