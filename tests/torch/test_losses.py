"""The losses are the library's own risks and likelihoods, and right under noise."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.constraints import projection
from unconstrain.fitting.likelihood import Views
from unconstrain.fitting.noise import Noise

torch = pytest.importorskip("torch")

RNG = np.random.default_rng(0)


def samples(d, N=40):
    """Predictions, actions, projections of which half are unknown, and probabilities."""
    P, U = RNG.normal(size=(2, N, d))
    projections = projection(RNG.normal(size=(N, 1, d)))
    U = np.einsum("nij,nj->ni", projections, U)
    projections[::2] = np.nan
    return P, U, projections, RNG.uniform(size=N)


def gradient(loss, P, *args, dtype=torch.float64, **kwargs):
    """A loss and its gradient by the predictions, as arrays."""
    p = torch.tensor(P, dtype=dtype, requires_grad=True)
    value = loss(p, *args, **kwargs)
    value.sum().backward()
    return value.detach().numpy(), p.grad.numpy()


@pytest.mark.parametrize("d", [1, 2, 7])
def test_without_noise_it_is_the_inconsistency_of_metrics(d):
    P, U, projections, free = samples(d)
    U[:3] = 0.0
    p = torch.tensor(P)
    assert uc.torch.inconsistency_loss(p, U).item() == pytest.approx(uc.metrics.inconsistency(U, P))
    known = uc.torch.inconsistency_loss(p, U, projections).item()
    assert known == pytest.approx(uc.metrics.inconsistency(U, P, projections))
    shown = uc.torch.inconsistency_loss(p, U, free=free).item()
    assert shown == pytest.approx(uc.metrics.shown_error(U, P, free))


@pytest.mark.parametrize("d", [1, 2, 3, 7, 27])
@pytest.mark.parametrize("noise", [1e-3, 0.1, 30.0])
def test_the_likelihood_is_that_of_the_library_with_its_gradient(d, noise):
    P, U, _, free = samples(d)
    views = Views(U, P, Noise(noise**2), np.full(len(U), float(d)))
    value, slope = gradient(uc.torch.adaptive_loss, P, U, noise, free=free, reduction="none")
    log = free * views.whole.log + (1 - free) * views.constrained.log
    expected = free[:, None] * views.whole.gradient + (1 - free)[:, None] * views.constrained.gradient
    np.testing.assert_allclose(value, -log, rtol=1e-8)
    np.testing.assert_allclose(slope, -expected, rtol=1e-6, atol=1e-8 * np.abs(expected).max())
    marginal, _ = gradient(uc.torch.adaptive_loss, P, U, noise, free_share=0.3, reduction="none")
    together = np.logaddexp(np.log(0.3) + views.whole.log, np.log(0.7) + views.constrained.log)
    np.testing.assert_allclose(marginal, -together, rtol=1e-8)


def truth(d, rank, same, count):
    """A policy, and points of its sphere: anywhere, or all one and the same."""
    rng = np.random.default_rng([d, rank])
    Pi = np.eye(d)[0]
    bases = np.linalg.qr(rng.normal(size=(1 if same else count, d, d)))[0][:, :, :rank]
    if same and np.linalg.norm(bases[0, 0]) < 0.5:  # hardly anything is left of the policy otherwise
        bases[0, :, 0] = np.sqrt(0.5) * np.eye(d)[0] + np.sqrt(0.5) * np.eye(d)[1]
        bases[0] = np.linalg.qr(bases[0])[0]
    V = np.einsum("nik,njk,j->ni", bases, bases, Pi)
    return np.tile(Pi, (count, 1)), np.tile(V, (count // len(V), 1)), rng


@pytest.mark.parametrize("same", [False, True])
@pytest.mark.parametrize(("d", "rank"), [(2, 1), (3, 2), (6, 1), (6, 4)])
@pytest.mark.parametrize("noise", [0.05, 0.15, 0.3])
def test_the_expected_gradient_at_the_truth_is_zero(d, rank, noise, same):
    Pi, V, rng = truth(d, rank, same, 20_000)
    # Noise and its reflection: what is odd in it cancels, and with it most of the scatter.
    eps = noise * rng.normal(size=V.shape)
    Pi, U = np.tile(Pi, (2, 1)), np.concatenate([V + eps, V - eps])

    def bias(loss, *args, **kwargs):
        slopes = gradient(loss, Pi, U, *args, reduction="sum", **kwargs)[1]
        pairs = (slopes[: len(V)] + slopes[len(V) :]) / 2
        return np.abs(pairs.mean(axis=0)), pairs.std(axis=0) / np.sqrt(len(V))

    plain, _ = bias(uc.torch.inconsistency_loss)
    off, deviation = bias(uc.torch.inconsistency_loss, noise=noise)
    assert (off < 5 * deviation + 1e-12).all()
    # Exact up to terms in σ²/R²; the published loss is off by several times that, and here in the same units.
    off, deviation = bias(uc.torch.adaptive_loss, noise, free=np.zeros(len(U)))
    off, deviation = 2 * noise**2 * off, 2 * noise**2 * deviation
    assert np.linalg.norm(off) < 5 * np.linalg.norm(deviation) + 1.5 * noise**2
    if noise == 0.05:
        assert np.linalg.norm(off) < 0.1 * np.linalg.norm(plain) + 5 * np.linalg.norm(deviation)


def test_a_step_down_the_corrected_loss_finds_the_policy_and_one_down_the_published_does_not():
    rng = np.random.default_rng(3)
    Pi = np.tile([1.0, -0.5, 0.3], (4000, 1))
    N = projection(rng.normal(size=(4000, 2, 3)))
    U = np.einsum("nij,nj->ni", N, Pi) + 0.2 * rng.normal(size=Pi.shape)
    off = {}
    for name, loss in {
        "published": lambda p: uc.torch.inconsistency_loss(p, U),
        "corrected": lambda p: uc.torch.inconsistency_loss(p, U, noise=0.2),
        "adaptive": lambda p: uc.torch.adaptive_loss(p, U, 0.2, free_share=0.0),
    }.items():
        p = torch.zeros(3, dtype=torch.float64, requires_grad=True)
        with torch.no_grad():
            p += torch.tensor(U.mean(axis=0))
        optimizer = torch.optim.Adam([p], lr=0.05)
        for _ in range(80):
            optimizer.zero_grad()
            loss(p.expand(4000, 3)).backward()
            optimizer.step()
        off[name] = float(np.linalg.norm(p.detach().numpy() - Pi[0]))
    assert off["corrected"] < 0.05
    assert off["adaptive"] < 0.05
    assert off["published"] > 3 * max(off["corrected"], off["adaptive"])


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
@pytest.mark.parametrize("noise", [1e-12, 1.0, 1e12])
def test_it_stays_finite_in_low_precision(dtype, noise):
    P = np.array([[0.0, 0.0], [1.0, 0.0], [1e-20, 0.0], [2.0, 2.0], [1e6, 0.0], [0.5, 0.5]])
    U = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.25, 0.25]])
    for options in ({}, {"free_share": 0.0}, {"free_share": 1.0}, {"free": [0, 1, 0, 1, 0, 0.5]}):
        p = torch.tensor(P, dtype=dtype, requires_grad=True)
        loss = uc.torch.adaptive_loss(p, U, noise, **options)
        loss.backward()
        assert torch.isfinite(loss)
        assert torch.isfinite(p.grad).all()
        assert loss.dtype == p.grad.dtype == dtype


def test_noise_can_be_learnt_along():
    rng = np.random.default_rng(0)
    Pi = rng.normal(size=(3000, 3))
    N = projection(rng.normal(size=(3000, 1, 3)))
    U = np.einsum("nij,nj->ni", N, Pi) + 0.1 * rng.normal(size=Pi.shape)
    log_noise = torch.zeros((), dtype=torch.float64, requires_grad=True)
    optimizer = torch.optim.Adam([log_noise], lr=0.1)
    for _ in range(100):
        optimizer.zero_grad()
        uc.torch.adaptive_loss(torch.tensor(Pi), U, log_noise.exp(), free_share=0.0).backward()
        optimizer.step()
    assert log_noise.exp().item() == pytest.approx(0.1, rel=0.05)


def test_chunks_of_actions_weights_and_reductions():
    P, U, projections, free = samples(3, N=24)
    weights = RNG.uniform(size=24)
    for loss, args in ((uc.torch.inconsistency_loss, ()), (uc.torch.adaptive_loss, (0.3,))):
        options = {"projections": projections, "free": free, "weights": weights}
        flat = loss(torch.tensor(P), U, *args, **options, reduction="none")
        chunked = {name: value.reshape(4, 6, *value.shape[1:]) for name, value in options.items()}
        both = torch.tensor(P).reshape(4, 6, 3), U.reshape(4, 6, 3)
        each = loss(both[0], both[1], *args, **chunked, reduction="none")
        assert each.shape == (4, 6)
        torch.testing.assert_close(each.flatten(), flat)
        mean = loss(torch.tensor(P), U, *args, **options)
        torch.testing.assert_close(mean, flat.sum() / weights.sum())


@pytest.mark.parametrize(
    ("arguments", "options", "sentence"),
    [
        ((np.zeros((3, 2)), np.zeros((3, 2)), 1.0), {}, "predictions must be a tensor"),
        ((torch.zeros(3, 2), np.zeros((2, 3)), 1.0), {}, r"actions \(2, 3\) must have the shape \(3, 2\)"),
        ((torch.zeros(3, 2), np.zeros((3, 2)), 0.0), {}, "noise must be a positive number"),
        (
            (torch.zeros(3, 2), np.zeros((3, 2)), 1.0),
            {"free": [1.0]},
            r"free \(1,\) must have the shape \(3,\)",
        ),
        ((torch.zeros(3, 2), np.zeros((3, 2)), 1.0), {"free_share": 2.0}, "free_share must be a probability"),
        ((torch.zeros(3, 2), np.zeros((3, 2)), 1.0), {"reduction": "max"}, "reduction must be one of"),
    ],
)
def test_mistakes_are_one_sentence(arguments, options, sentence):
    with pytest.raises(uc.errors.DataError, match=sentence):
        uc.torch.adaptive_loss(*arguments, **options)
