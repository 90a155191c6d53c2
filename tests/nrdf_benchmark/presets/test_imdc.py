import torch

from nrdf.field import build_field


def small():
    torch.manual_seed(0)
    return build_field("imdc", {"implicit_widths": (64, 32), "inverse_width": 32})


def test_a_point_is_inside_where_its_largest_branch_says_so():
    field = small().eval()
    points = 0.3 * torch.randn(2, 50, 3)
    z = field.embed(points, points)
    k = field.describe(z, points, points)
    assert z.shape == (2, 256) and k.shape == (2, 50, 12)
    assert torch.allclose(k.max(dim=-1).values, field.occupancy(z, points).sigmoid(), atol=1e-6)
    landed = field.invert(z, k).points
    assert landed.shape == (2, 50, 3) and landed.abs().max() <= 1


def test_sizes_are_the_authors():
    assert sum(p.numel() for p in build_field("imdc").decoder.parameters()) == (
        259 * 3072 + 3072 + 3072 * 384 + 384 + 384 * 12 + 12
    )


def test_every_weight_learns():
    field = small().train()
    points = 0.3 * torch.randn(3, 50, 3)
    z = field.embed(points, points)
    loss = field.invert(z.roll(1, 0), field.describe(z, points, points)).points.square().sum()
    (loss + field.occupancy(z, points).sum()).backward()
    for name, parameter in field.named_parameters():
        assert parameter.grad is not None and parameter.grad.isfinite().all(), name
    assert field.encoder.leave.weight.grad.abs().sum() > 0
