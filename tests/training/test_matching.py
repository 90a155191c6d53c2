"""Matching against scipy and against shapes whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from nrdf.training import matching


@pytest.fixture
def clouds():
    generator = torch.Generator().manual_seed(3)
    return torch.rand(2, 200, 3, generator=generator), torch.rand(2, 150, 3, generator=generator)


def test_nearest_indices_agree_with_a_tree_whatever_the_chunks(clouds, monkeypatch):
    query, reference = clouds
    for pairs_at_once in (1 << 24, 1000, 1):
        monkeypatch.setattr(matching, "PAIRS_AT_ONCE", pairs_at_once)
        found = matching.nearest_indices(query, reference)
        for element in range(2):
            _, expected = cKDTree(reference[element].numpy()).query(query[element].numpy())
            assert np.array_equal(found[element].numpy(), expected)


def test_neighbour_indices_are_sorted_and_complete(clouds):
    query, reference = clouds
    found = matching.neighbour_indices(query, reference, 7)
    _, expected = cKDTree(reference[1].numpy()).query(query[1].numpy(), k=7)
    assert np.array_equal(found[1].numpy(), expected)


def test_normals_tell_the_sides_of_a_thin_sheet_apart():
    plane = torch.rand(1, 60, 3, generator=torch.Generator().manual_seed(0))
    plane[..., 1] = 0.0
    up = torch.tensor([0.0, 1.0, 0.0]).expand(1, 60, 3)
    sheet = torch.cat([plane + 0.005 * up, plane - 0.005 * up], dim=1)
    normals = torch.cat([up, -up], dim=1)
    above = matching.with_normals(plane - 0.001 * up, up, 0.1)  # nearer to the lower side
    found = matching.nearest_indices(above, matching.with_normals(sheet, normals, 0.1))
    assert (found < 60).all()
    assert (matching.nearest_indices(plane - 0.001 * up, sheet) >= 60).all()


def test_nearest_distance_has_gradients_on_both_sides(clouds):
    query, reference = (cloud.clone().requires_grad_() for cloud in clouds)
    matching.nearest_distance(query, reference, squared=True).sum().backward()
    moved = query.detach() - 0.4 * query.grad
    before = matching.nearest_distance(query.detach(), reference.detach()).mean()
    assert matching.nearest_distance(moved, reference.detach()).mean() < 0.3 * before
    assert reference.grad.abs().sum() > 0


def test_nearest_distance_of_equal_points_has_a_finite_gradient():
    points = torch.zeros(1, 4, 3, requires_grad=True)
    matching.nearest_distance(points, torch.zeros(1, 4, 3)).sum().backward()
    assert points.grad.isfinite().all()


def test_local_normals_of_a_sphere_point_outward():
    points = torch.nn.functional.normalize(
        torch.randn(1, 1000, 3, generator=torch.Generator().manual_seed(0)), dim=-1
    )
    normals = matching.local_normals(points, neighbours=16, towards=points)
    cosine = (normals * points).sum(-1)
    assert cosine.mean() > 0.99 and cosine.min() > 0.9


def test_local_normals_derivative_is_that_of_differences():
    generator = torch.Generator().manual_seed(1)
    points = torch.rand(1, 30, 3, generator=generator)
    points[..., 2] *= 0.05
    points.requires_grad_()
    up = torch.tensor([0.0, 0.0, 1.0]).expand(1, 30, 3)
    probe = torch.randn(1, 30, 3, generator=generator)

    def value(p):
        return (matching.local_normals(p, neighbours=30, towards=up) * probe).sum()

    (gradient,) = torch.autograd.grad(value(points), points)
    direction = torch.randn(1, 30, 3, generator=generator)
    step = 1e-3
    with torch.no_grad():
        difference = value(points + step * direction) - value(points - step * direction)
    expected = float(difference) / (2 * step)
    # Bounding the eigenvalue gaps costs a few per cent.
    assert float((gradient * direction).sum()) == pytest.approx(expected, rel=0.1)


def test_local_normals_of_a_line_have_a_finite_derivative():
    points = torch.linspace(0, 1, 40)[None, :, None] * torch.tensor([1.0, 0.0, 0.0])
    points = points.requires_grad_()
    matching.local_normals(points).square().sum().backward()
    assert points.grad.isfinite().all()


@pytest.mark.parametrize(
    ("n", "iterations", "excess"), [(1, 50, 0.0), (2, 50, 0.0), (200, 50, 0.15), (200, 1500, 0.03)]
)
def test_assignment_costs_little_more_than_the_best(n, iterations, excess):
    generator = torch.Generator().manual_seed(n)
    a = torch.rand(3, n, 3, generator=generator) - 0.5
    b = torch.rand(3, n, 3, generator=generator) - 0.5
    found = matching.assign(a, b, iterations=iterations)
    for element in range(3):
        assert sorted(found[element].tolist()) == list(range(n))
        cost = torch.cdist(a[element], b[element]).numpy()
        rows, columns = linear_sum_assignment(cost)
        ours = cost[np.arange(n), found[element].numpy()].sum()
        assert ours <= (1.0001 + excess) * cost[rows, columns].sum()


def test_assignment_of_a_cloud_to_its_shuffle_is_the_shuffle():
    generator = torch.Generator().manual_seed(0)
    a = torch.rand(1, 128, 3, generator=generator)
    order = torch.randperm(128, generator=generator)
    found = matching.assign(a, a[:, order])
    assert torch.equal(order[found[0]], torch.arange(128))


def test_assignment_refuses_unequal_sizes(clouds):
    with pytest.raises(ValueError, match="equal sizes"):
        matching.assign(*clouds)


def test_nearest_both_ways_equals_one_way_after_the_other():
    generator = torch.Generator().manual_seed(0)
    a, b = (torch.randn(2, n, 40, generator=generator) + 5 for n in (9, 12))
    there, back = matching.nearest_both_ways(a, b)
    assert torch.allclose(there, matching.nearest_distance(a, b), atol=1e-4)
    assert torch.allclose(back, matching.nearest_distance(b, a), atol=1e-4)


def test_normals_of_some_points_are_those_of_all():
    points = torch.nn.functional.normalize(
        torch.randn(2, 200, 3, generator=torch.Generator().manual_seed(0)), dim=-1
    )
    rows = torch.tensor([5, 17, 80])
    every = matching.local_normals(points, towards=points)
    some = matching.local_normals(points, rows, towards=points[:, rows])
    assert torch.allclose(some, every[:, rows], atol=1e-6)
