"""The paper's network, small enough to train in a test."""

SMALL = {
    "residual_size": 8,
    "convolution_size": 12,
    "point_features": 4,
    "decoder_width": 16,
    "decoder_blocks": 2,
    "inverse_widths": (24, 16, 8),
}
