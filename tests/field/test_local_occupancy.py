"""Occupancy by the near points: which side, on sheets too, wherever and however large."""

from __future__ import annotations

import pytest
import torch
from torch.nn import functional

from nrdf.errors import ConfigError
from nrdf.field import build_field
from nrdf.field.local_occupancy import LocalOccupancy


def plates(thickness: float, seed: int, count: int = 512) -> tuple[torch.Tensor, torch.Tensor]:
    """Points and normals of both sides of a plate of 0.4 by 0.4, (1, n, 3)."""
    generator = torch.Generator().manual_seed(seed)
    points = (torch.rand(1, count, 3, generator=generator) - 0.5) * 0.4
    side = 2.0 * torch.randint(2, (1, count), generator=generator) - 1
    points[..., 2] = side * thickness / 2
    normals = torch.zeros_like(points)
    normals[..., 2] = side
    return points, normals


@pytest.fixture(scope="module")
def trained() -> LocalOccupancy:
    torch.manual_seed(0)
    head = LocalOccupancy(32)
    optimizer = torch.optim.AdamW(head.parameters(), 5e-3)
    for step in range(150):
        thickness = 0.01 + 0.1 * (step % 10) / 10
        places, inside = around(thickness, step)
        loss = functional.binary_cross_entropy_with_logits(
            head(places, *plates(thickness, step)), inside
        )
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return head.eval()


def around(thickness: float, seed: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Places about a plate, away from its rim, and whether each is in it."""
    generator = torch.Generator().manual_seed(1000 + seed)
    places = (torch.rand(1, 256, 3, generator=generator) - 0.5) * 0.3
    places[..., 2] *= 10 * thickness
    return places, (places[..., 2].abs() < thickness / 2).float()


def share_right(head: LocalOccupancy, thickness: float) -> float:
    places, inside = around(thickness, 500)
    with torch.inference_mode():
        return float(((head(places, *plates(thickness, 501)) > 0) == (inside > 0)).float().mean())


def test_it_tells_the_inside_of_plates_thinner_than_their_points_are_apart(trained):
    # Points are some 0.025 apart. Two thirds of the places are outside.
    for thickness, share in ((0.02, 0.85), (0.05, 0.95), (0.1, 0.97)):
        assert share_right(trained, thickness) > share


def test_only_what_is_near_counts(trained):
    points, normals = plates(0.05, 0)
    places, _ = around(0.05, 1)
    beside = torch.cat([points, points + 5], dim=1), torch.cat([normals, -normals], dim=1)
    torch.testing.assert_close(trained(places, points, normals), trained(places, *beside))


def test_the_order_of_points_does_not_matter_and_few_are_enough(trained):
    points, normals = plates(0.05, 0)
    places, _ = around(0.05, 1)
    order = torch.randperm(points.shape[1])
    one = trained(places, points, normals)
    torch.testing.assert_close(one, trained(places, points[:, order], normals[:, order]))
    assert trained(places, points[:, :5], normals[:, :5]).isfinite().all()


def test_a_width_that_attention_cannot_share_is_refused():
    with pytest.raises(ConfigError, match="'occupancy_width': Input should be a multiple of 8"):
        build_field("default", {"occupancy_width": 12})
