"""A trained model: set a reference once, then find its regions on every new object."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nrdf.field.cloud_encoder import CloudEncoder
from nrdf.field.device import choose_device
from nrdf.field.zoo import load_field
from nrdf.io.inputs import as_cloud
from nrdf.regions.reference import EncodedReference


class Model(CloudEncoder):
    """A trained field of one category: encodes clouds and takes references.

    In eight lines, as `nrdf.load_model` gives it:

        model = nrdf.load_model("chair")
        reference = model.set_reference("reference.ply")
        match = reference.retrieve(region, "target.ply")

    field: the network; metadata: what its weight file says of itself (category, preset, ...).
    """

    def set_reference(self, reference: Any) -> EncodedReference:
        """Encode a reference and compute its surface's descriptors once, for any number of targets.

        Args:
            reference: what `nrdf.as_cloud` takes: a PointCloud, a path, an array (n, 3), a mesh, in
                the canonical orientation (+X forward, +Y up).

        Raises:
            CloudError: the reference cannot be used, as `encode` says.
        """
        return EncodedReference(self, self.encode(as_cloud(reference, "the reference")))


def load_model(name: str | Path, device: str = "cpu") -> Model:
    """The model of a zoo name ("chair"), of a weight file, or of a finished training run's folder.

    Args:
        name: zoo name, or path.
        device: "cpu", "cuda", "cuda:1", … or "auto" (CUDA where there is one).

    Raises:
        ModelError: the name is not known (those that are, are listed), or the file is truncated
            or altered.
        ConfigError: this machine does not have the device.
    """
    field, metadata = load_field(name)
    return Model(field, metadata, device=choose_device(device))
