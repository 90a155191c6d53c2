"""Sessions of the studio with a painted box, and a studio whose inputs are called directly."""

from __future__ import annotations

import numpy as np

import nrdf
from builders.taught_box import SIZE, cloud, faces
from nrdf.errors import ModelError
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.session import Session


def small_box(scale=1.0, seed=0):
    """A box of half the size of `taught_box`, so that meshes of its points are small."""
    return cloud(0.5 * scale * SIZE, seed=seed)


def silent(done, total):
    """Ignores progress."""


def face(of, name):
    """A box's face as a mask of its points."""
    mask = np.zeros(len(of), bool)
    mask[faces(of)[name]] = True
    return mask


def box_editor(folder, **kinds):
    """An editor with a box; each region is a face of it, with a process of that kind."""
    editor = Editor(Session(folder))
    editor.open_reference("box.ply", small_box(), "chair")
    for name, kind in kinds.items():
        editor.add_region(name)
        editor.paint(REFERENCE, name, face(small_box(), name))
        editor.restart_step(name, 0, kind)
    return editor


class Page:
    """A studio with a box, two regions and a target, and what it has said on its pages."""

    def __init__(self, folder, weights):
        from nrdf.studio.app import Studio
        from nrdf.studio.model.computing import LocalComputing
        from nrdf.studio.serving import open_server

        self.weights, self.notes = weights, []
        self.server = open_server("127.0.0.1", 8460)
        computing = LocalComputing(self.load)
        self.studio = Studio(Session(folder), self.server, computing, ["chair"], {})
        self.studio.make_surfaces = lambda: None  # nobody sees them
        notify = self.studio.notify

        def noted(title, text, bad=True):
            self.notes.append(text)
            notify(title, text, bad)

        self.studio.notify = noted
        self.editor = self.studio.editor
        self.editor.open_reference("box.ply", small_box(), "chair")
        for name in ("top", "front"):
            self.editor.add_region(name)
            self.paint(name, faces(small_box())[name])
        self.editor.add_target("new.ply", small_box(1.1, seed=1))
        self.studio.sync()
        self.studio.region = "top"

    def load(self, category):
        """The model, or the error of an installation without one."""
        if self.weights is None:
            raise ModelError(f"no model for '{category}'; known: plane")
        return nrdf.load_model(self.weights)

    def paint(self, name, indices):
        """Set a region of the reference."""
        mask = np.zeros(len(small_box()), bool)
        mask[indices] = True
        self.editor.paint(REFERENCE, name, mask)

    def does(self, act, *words):
        """Do what an input does; everything that the studio says to it."""
        self.notes.clear()
        with self.studio.reporting_errors():
            act(*words)
        assert self.studio.worker.wait(60)
        return " ".join(self.notes)

    def transfer(self):
        """Press 'Transfer the process'."""
        return self.does(self.studio.panel.targets._transfer)

    def change(self, **numbers):
        """Set numbers of the process; what the panel says of its plan."""
        self.editor.change_numbers("top", 0, numbers)
        self.does(self.studio.plan, 0.0)
        return self.studio.panel.process.status.content

    def end(self):
        """End the studio and its server."""
        self.studio.stop()
        self.server.stop()
