"""The network of the potential against torch's automatic differentiation of the same weights."""

import numpy as np
import pytest
import torch
from tests.models.learned.problem import GM, samples

from unmodeled.models.learned import PotentialMLP


def derivatives(potential, x):
    """Value, gradient and second derivatives of a function of one position, by autograd."""
    x = x.detach().clone().requires_grad_()
    value = potential(x)
    first = torch.autograd.grad(value, x, create_graph=True)[0]
    second = [torch.autograd.grad(f, x, create_graph=True)[0] for f in first]
    return value, first, torch.stack(second)


def torch_potential(model, x):
    """U at one position, written from the formula and the saved weights, in torch only."""
    arrays = {key: torch.from_numpy(value) for key, value in model._arrays().items()}
    weights = arrays["unknowns"]
    bend = torch.sin if model.activation == "sine" else torch.tanh

    def network(h):
        at, size = 1, len(h)
        for _ in range(model.layers):
            end = at + model.width * size
            h = bend(
                weights[at:end].reshape(model.width, size) @ h + weights[end : end + model.width]
            )
            at, size = end + model.width, model.width
        return weights[at:] @ h

    r = torch.linalg.vector_norm(x)
    if model.inputs == "kelvin":
        rest = (network(x / r**2) - network(torch.zeros(3, dtype=torch.float64))) / r
    else:
        rest = network(torch.cat([x / r, 1 / r[None]])) / r**2
    return GM * (weights[0] / r + rest)


@pytest.mark.parametrize(("inputs", "activation"), [("kelvin", "sine"), ("direction", "tanh")])
def test_acceleration_gradient_and_laplacian_by_automatic_differentiation(inputs, activation):
    X, y, held, _ = samples()
    model = PotentialMLP(width=8, steps=20, inputs=inputs, activation=activation).fit(X, y)
    at = np.concatenate([held, 1.7 * held[:3], 0.6 * held[:3]])
    a, J, potential = model.predict(at), model.jacobian(at), model.potential(at)
    laplacian = model._field.laplacian(at, model._unknowns)
    for k, x in enumerate(torch.from_numpy(at)):
        parts = derivatives(lambda p: torch_potential(model, p), x)
        value, first, second = (p.detach().numpy() for p in parts)
        # the same sums in another order: rounding
        assert potential[k] == pytest.approx(float(value), rel=1e-12)
        np.testing.assert_allclose(a[k], first, rtol=0, atol=1e-12 * GM)
        np.testing.assert_allclose(J[k], second, rtol=0, atol=1e-11 * GM)
        trace = float(np.trace(second)) * np.linalg.norm(at[k]) ** 5 / GM
        assert laplacian[k] == pytest.approx(trace, abs=1e-9)


def test_slopes_of_acceleration_and_laplacian_by_the_weights():
    X, y, held, _ = samples()
    model = PotentialMLP(layers=2, width=5, steps=10).fit(X, y)
    x = held[:1]
    _, slopes = model._field.slopes(x, model._unknowns)
    _, bends = model._field.laplacian_slopes(x, model._unknowns)
    weights = torch.from_numpy(model._unknowns.copy())

    def potential(w, p):
        h, start, size = p / (p @ p), 1, 3
        zero = torch.zeros(3, dtype=torch.float64)
        for _ in range(2):
            end = start + 5 * size
            matrix, bias = w[start:end].reshape(5, size), w[end : end + 5]
            h, zero = torch.sin(matrix @ h + bias), torch.sin(matrix @ zero + bias)
            start, size = end + 5, 5
        return (w[0] + w[start:] @ (h - zero)) / torch.sqrt(p @ p)

    weights.requires_grad_()
    parts = derivatives(lambda p: potential(weights, p), torch.from_numpy(x[0]))
    outputs = [*parts[1], torch.trace(parts[2])]
    rows = [torch.autograd.grad(o, weights, retain_graph=True)[0].numpy() for o in outputs]
    np.testing.assert_allclose(slopes[0], rows[:3], rtol=0, atol=1e-12)
    r5 = np.linalg.norm(x) ** 5
    np.testing.assert_allclose(bends[0], r5 * rows[3], rtol=0, atol=1e-10 * r5)
