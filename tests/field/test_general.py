"""The general field: both ways at once, for points anywhere, and what it does not have."""

from __future__ import annotations

import pytest
import torch

import nrdf
from nrdf.errors import ModelError
from nrdf.field.general import GeneralConfig, GeneralField, pack, unpack

SMALL = GeneralConfig(tokens=48, width=32, heads=2, looks=2)
STRETCH = torch.tensor([1.0, 0.7, 1.0])


def box(seed: int, count: int = 512) -> tuple[torch.Tensor, torch.Tensor]:
    """Points on a box of sides 1, 0.6 and 0.4, with normals."""
    generator = torch.Generator().manual_seed(seed)
    half = torch.tensor([0.5, 0.3, 0.2])
    points = (2 * torch.rand(1, count, 3, generator=generator) - 1) * half
    axis = torch.randint(3, (1, count, 1), generator=generator)
    sign = 2.0 * torch.randint(2, (1, count, 1), generator=generator) - 1
    normals = torch.zeros(1, count, 3).scatter(2, axis, sign)
    return torch.where(normals != 0, normals * half, points), normals


@pytest.fixture(scope="module")
def field():
    torch.manual_seed(0)
    return GeneralField(SMALL).eval()


def test_tokens_come_back_from_an_embedding(field):
    z = field.embed(*box(0))
    tokens = unpack(z, SMALL.tokens)
    assert tokens.points.shape == (1, 48, 3) and z.dtype == torch.float32
    packed = pack(tokens)
    torch.testing.assert_close(packed, z[:, : packed.shape[1]])


def test_the_zoos_field_knows_the_inside_of_a_box():
    model = nrdf.load_model("general")
    half = torch.tensor([0.5, 0.3, 0.2])
    queries = (2 * torch.rand(1, 400, 3, generator=torch.Generator().manual_seed(3)) - 1) * 0.5
    inside = (queries.abs() < half).all(-1)
    with torch.inference_mode():
        found = model.field.occupancy(model.field.embed(*box(0, 1024)), queries) > 0
    assert float((found == inside).float().mean()) > 0.97


def test_the_map_back_is_the_map_of_the_pair_turned_round(field):
    one, other = field.embed(*box(0)), field.embed(box(1)[0] * STRETCH, box(1)[1])
    there, back = field.correspond(one, other)
    again, _ = field.correspond(other, one)
    torch.testing.assert_close(back.places.points, again.places.points)
    assert not torch.allclose(there.places.points, back.places.points)


def test_other_points_move_as_the_tokens_beside_them(field):
    points, normals = box(0)
    one, other = field.embed(points, normals), field.embed(points * STRETCH, normals)
    map_ = field.correspond(one, other)[0]
    found = map_.transfer(map_.source.points, map_.source.normals)
    shift = (found.points - map_.places.points).norm(dim=-1)
    assert float(shift.detach().median()) < 0.02
    direct = field.transfer(one, points, normals, other)
    torch.testing.assert_close(direct.points, map_.transfer(points, normals).points)
    assert found.existence.shape == found.log_error.shape == (1, 48)


def test_what_belongs_to_a_pair_is_refused_for_one_shape(field):
    points, normals = box(0)
    z = field.embed(points, normals)
    for ask in (
        lambda: field.describe(z, points, normals),
        lambda: field.invert(z, points),
    ):
        with pytest.raises(ModelError, match="the model general has no"):
            ask()


def test_the_zoos_field_knows_a_box_of_other_proportions():
    model = nrdf.load_model("general")
    points, normals = box(0, 2048)
    turned = box(1, 2048)
    other = (turned[0] * torch.tensor([1.0, 1.6, 0.6]), turned[1])
    with torch.inference_mode():
        one, two = (model.field.embed(*shape) for shape in ((points, normals), other))
        found = model.field.transfer(one, points, normals, two)
    error = (found.points - points * torch.tensor([1.0, 1.6, 0.6])).norm(dim=-1)
    assert float(error.mean()) < 0.04
