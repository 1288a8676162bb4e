"""Truth, samples, linear rows and the network of the protocol."""

from pathlib import Path

import numpy as np
import pinn_protocol
import pytest
import torch
from pinn.linear import LinearField, harmonic_design, mascon_design
from pinn.network import PinnGM, _loss
from pinn.rows import ROWS, UNIT_A, Row, Samples, inside_points, units
from pinn.truth import GM, RADIUS, SHARE, VOLUME, Truth, eros_mesh, observations, outside_points

from unmodeled.core.errors import NumericalError
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned import PointMassOnly

DIRECTIONS = np.random.default_rng(1).standard_normal((20, 3))
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1)[:, None]


@pytest.fixture(scope="module")
def truth() -> Truth:
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("UNMODELED_DATA", raising=False)
        mesh, source = eros_mesh()
    assert source == "eros_like (built-in shape)"
    return Truth(mesh)


def test_shape_has_the_volume_of_eros_about_its_centroid(truth: Truth) -> None:
    assert truth.mesh.volume == pytest.approx(VOLUME)
    assert np.abs(truth.mesh.centroid).max() < 1e-6 * RADIUS


def test_far_away_it_is_the_mass_and_the_dipole_of_the_hidden_masses(truth: Truth) -> None:
    """Mass GM; dipole 0.1 GM (R/2 + R/2) along +x: without it a point mass is 0.2 R/r wrong."""
    r = 1000 * RADIUS
    expected = -GM / r**2 * DIRECTIONS
    dipole = np.array([SHARE * RADIUS, 0.0, 0.0])
    along = DIRECTIONS @ dipole
    expected += GM / r**3 * (dipole - 3 * along[:, None] * DIRECTIONS)
    # quadrupole of the body: (0.2 to 0.5) (R/r)^2
    error = np.linalg.norm(truth.acceleration(r * DIRECTIONS) - expected, axis=1)
    assert error.max() < 1e-6 * GM / r**2


def test_closed_form_and_series_meet(truth: Truth) -> None:
    below, above = (truth.acceleration(DIRECTIONS * RADIUS * (2.5 + s)) for s in (-1e-9, 1e-9))
    error = np.linalg.norm(below - above, axis=1) / np.linalg.norm(above, axis=1)
    assert error.max() < 1e-7  # degree 25 and up at 2.5 radii


def test_points_lie_where_they_should_and_none_inside(truth: Truth) -> None:
    """Divided by the norm of the whole matrix, as at a peer, none would."""
    for inner, outer in ((0.0, 1.0), (10.0, 100.0)):
        points = outside_points(truth, inner, outer, 50, "test")
        radius = np.linalg.norm(points, axis=1) / RADIUS
        assert radius.shape == (50,)
        assert inner <= radius.min() < radius.max() <= outer
        assert radius.max() > outer / 2
        assert not truth.inside(points).any()


def test_noise_has_its_length_at_every_sample(truth: Truth) -> None:
    x, clean = observations(truth, 40, 0.0)
    same, noisy = observations(truth, 40, 0.1)
    np.testing.assert_array_equal(x, same)
    share = np.linalg.norm(noisy - clean, axis=1) / np.linalg.norm(clean, axis=1)
    np.testing.assert_allclose(share, 0.1, rtol=1e-9)


def test_units_make_the_mass_4_pi_squared() -> None:
    x = DIRECTIONS * 3 * RADIUS
    a = -GM * x / np.linalg.norm(x, axis=1)[:, None] ** 3
    nx, na = units(x, a)
    np.testing.assert_allclose(na, PointMassOnly()._predict(nx), rtol=1e-12)


def test_chunks_give_what_one_least_squares_gives() -> None:
    """A peer's sequential update diverges beyond 1,000 samples; here 5,000 in three chunks."""
    generator = np.random.default_rng(2)
    x = generator.standard_normal((5000, 3))
    x *= (generator.uniform(1.5, 4.0, 5000) / np.linalg.norm(x, axis=1))[:, None]
    y = -x / np.linalg.norm(x, axis=1)[:, None] ** 3 + 1e-3 * generator.standard_normal((5000, 3))
    design = harmonic_design(3)
    weight = np.sum(x**2, axis=1)
    field = LinearField(design).fit(x, y, weight)
    rows = (design(x) * weight).transpose(2, 0, 1).reshape(-1, 16)
    expected = np.linalg.lstsq(rows, (y * weight[:, None]).ravel(), rcond=None)[0]
    np.testing.assert_allclose(field.coefficients, expected, rtol=1e-8, atol=1e-11)


def test_mascons_find_the_masses_and_cross_validation_keeps_noise_out() -> None:
    generator = np.random.default_rng(4)
    places = generator.uniform(-0.3, 0.3, (60, 3))
    x = generator.standard_normal((300, 3))
    x *= (generator.uniform(1.0, 3.0, 300) / np.linalg.norm(x, axis=1))[:, None]
    true = np.full(60, 1 / 60)
    clean = np.einsum("ipn,p->ni", mascon_design(places)(x), true)
    assert clean[0] @ x[0] < 0  # masses attract
    noisy = clean * (1 + 0.1 * generator.standard_normal(clean.shape))
    field = LinearField(mascon_design(places), regularised=True).fit(x, noisy, np.sum(x**2, axis=1))
    plain = LinearField(mascon_design(places)).fit(x, noisy, np.sum(x**2, axis=1))
    places_of_test = 0.9 * x
    expected = np.einsum("ipn,p->ni", mascon_design(places)(places_of_test), true)
    error, worse = (np.linalg.norm(f.predict(places_of_test) - expected) for f in (field, plain))
    assert error < 0.2 * worse


def test_weights_do_not_follow_the_noise(truth: Truth) -> None:
    """By observed lengths the mass comes out 0.7 % too small at 10 % noise."""
    generator = np.random.default_rng(8)
    x = generator.standard_normal((20_000, 3))
    x *= (generator.uniform(1.5, 10.0, len(x)) / np.linalg.norm(x, axis=1))[:, None]
    direction = generator.standard_normal(x.shape)
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    clean = PointMassOnly()._predict(x)
    a = clean + 0.1 * np.linalg.norm(clean, axis=1)[:, None] * direction
    given = Samples(x, a, 0.1, truth)
    (mass,) = LinearField(harmonic_design(0)).fit(x, a, 1 / given.size).coefficients
    # one standard error: 0.1 / sqrt(3) / sqrt(20,000) = 4e-4
    assert mass / NORMALISED_GM == pytest.approx(1.0, abs=2.4e-3)
    by_observed = 1 / np.linalg.norm(a, axis=1)
    (biased,) = LinearField(harmonic_design(0)).fit(x, a, by_observed).coefficients
    assert biased / NORMALISED_GM < 0.996


def test_mascons_are_inside(truth: Truth) -> None:
    points = inside_points(truth, 55)
    assert points.shape == (55, 3)
    assert truth.inside(points).all()


def network(**settings: int) -> PinnGM:
    return PinnGM(NORMALISED_GM, 1.0, **({"units": 8, "layers": 2} | settings))


def samples(count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(5)
    x = generator.standard_normal((count, 3))
    x *= (generator.uniform(0.6, 8.0, count) / np.linalg.norm(x, axis=1))[:, None]
    a = PointMassOnly()._predict(x) + 0.1 * PointMassOnly()._predict(x - [0.3, 0.0, 0.0])
    return x, a


def test_an_untrained_network_is_the_point_mass() -> None:
    """Its last layer is zero; fused or blended twice, the mass would count double."""
    x, a = samples()
    model = network(epochs=0).fit(x, a)
    expected = PointMassOnly()._predict(x)
    np.testing.assert_allclose(model.predict(x), expected, rtol=2e-5)  # single precision


def test_the_network_falls_as_the_square_and_is_blended_away_once() -> None:
    """With a constant output c: U - U_pm = c (1 - h) / r^2 beyond 1, applied once."""
    x, a = samples()
    model = network(epochs=0).fit(x, a)._model
    with torch.no_grad():
        model.net[-1].bias.fill_(0.7)
    r = torch.tensor([0.5, 2.0, 4.0, 9.0, 14.0])
    along = torch.stack([r, 0 * r, 0 * r], dim=1)
    extra = (model(along)[:, 0] - model.mass / r).detach().numpy()
    h = 0.5 * (1 + np.tanh(0.5 * (r.numpy() - 10.0)))
    expected = 0.7 * (1 - h) / np.maximum(r.numpy(), 1.0) ** 2
    np.testing.assert_allclose(extra, expected, rtol=1e-3, atol=1e-6)


def test_the_acceleration_is_the_gradient_of_the_potential() -> None:
    x, a = samples()
    model = network(most_steps=50).fit(x, a)._model.double()
    point = torch.tensor([[1.3, -0.4, 0.8]], dtype=torch.float64)
    found = model.acceleration(point, False)[0].numpy()
    step = 1e-5
    for axis in range(3):
        shift = torch.zeros(1, 3, dtype=torch.float64)
        shift[0, axis] = step
        slope = (model(point + shift) - model(point - shift)).item() / (2 * step)
        assert found[axis] == pytest.approx(slope, rel=1e-6)


def test_the_best_state_is_kept_as_a_copy() -> None:
    """Kept by reference, as at a peer, "best" would be the last."""
    x, a = samples(40)
    a *= 1 + 0.3 * np.random.default_rng(6).standard_normal(a.shape)  # what is learned is noise
    model = network(most_steps=200).fit(x, a)
    assert model.loss_ < 0.99 * model.last_loss_
    held = np.random.default_rng(0).permutation(len(x))[: len(x) // 10]
    pair = [torch.as_tensor(v[held], dtype=torch.float32) for v in (x, a / model.scale_)]
    assert float(_loss(model._model, *pair, False)) == pytest.approx(model.loss_, rel=1e-5)


def test_training_helps_and_is_repeatable() -> None:
    x, a = samples()
    start, trained, again = (network(most_steps=n).fit(x, a) for n in (1, 150, 150))
    assert trained.loss_ < 0.5 * start.loss_
    np.testing.assert_array_equal(trained.predict(x), again.predict(x))


class Scaled:
    """A prediction that is a known factor off."""

    def __init__(self, truth: Truth, factor: float) -> None:
        self.truth, self.factor = truth, factor

    def predict(self, X: np.ndarray) -> np.ndarray:
        return self.factor * self.truth.acceleration(X * RADIUS) / UNIT_A


def test_every_row_is_measured_by_itself(
    truth: Truth, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A peer's notebook measured the truth in place of a model left over from another loop."""
    monkeypatch.setattr(pinn_protocol, "NODES", np.linspace(0.0, 60.0, 4))
    test = pinn_protocol.prepared(truth, 2, 5, tmp_path, "made-up")
    test["surface"] = (test["surface"][0][:9], test["surface"][1][:9])
    given = Samples(*units(*observations(truth, 8, 0.0)), 0.0, truth)
    results = [
        pinn_protocol.run(Row(f"{f}", lambda s, f=f: (Scaled(s.truth, f), 1), ""), given, test)
        for f in (1.0, 1.02, 0.9)
    ]
    for name in pinn_protocol.REGIONS:
        means = [r[f"{name}_mean"] for r in results]
        np.testing.assert_allclose(means, [0.0, 2.0, 10.0], atol=1e-9)
    assert results[0]["flight_cumulative_m"] < 1e-6
    assert results[1]["flight_rms_m"] > 1e-3


def test_what_is_refused_is_a_row_with_its_reason(truth: Truth) -> None:
    def fails(samples: Samples) -> tuple[object, int]:
        raise NumericalError("it broke")

    given = Samples(np.ones((3, 3)), np.ones((3, 3)), 0.0, truth)
    broke = pinn_protocol.run(Row("x", fails, ""), given, {})  # type: ignore[arg-type]
    assert broke == {"failure": "NumericalError: it broke."}
    large = pinn_protocol.run(Row("x", fails, "", most=2), given, {})  # type: ignore[arg-type]
    assert large == {"failure": "not run: 3 samples, at most 2 here"}


def test_rows_have_names_of_their_own_and_a_cut_line_does_not_count(tmp_path: Path) -> None:
    assert len({row.name for row in ROWS}) == len(ROWS)
    store = tmp_path / "rows.jsonl"
    store.write_text('{"key": "a", "failure": ""}\n{"key": "b", "fai')
    assert list(pinn_protocol.read(store)) == ["a"]
