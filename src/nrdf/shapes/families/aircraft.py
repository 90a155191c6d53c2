"""Puts an aircraft together: where wing, tail, engines and small parts go on a fuselage."""

from __future__ import annotations

import numpy as np

from nrdf.shapes.families import airframe as af
from nrdf.shapes.families.base import Part, rotation
from nrdf.shapes.families.furniture import bar, chance
from nrdf.shapes.families.plane_styles import Style
from nrdf.shapes.families.sections import Superellipse, linear, smooth
from nrdf.shapes.families.vehicle import blob, dish

_NOSE = {"jet": 0.6, "pod": 0.45}
"""Share of the front cone that is called nose; of others, nearly all of it."""


class Aircraft:
    """One aircraft; `parts` are ready once it is made."""

    def __init__(self, style: Style, rng: np.random.Generator) -> None:
        self.style, self.rng = style, rng
        self.fuselage = af.random_fuselage(style, rng)
        self.parts: list[Part] = []
        self._wing()
        fin_x = self._tail()
        self._engines()
        self._canopy()
        self._extras()
        self._gear()
        wing_x = 1 - style.edge
        front = max(1 - _NOSE.get(style.fuselage, 0.85) * style.nose, wing_x + 0.06)
        if style.engines == "nose" or style.fuselage == "warbird":
            front, back = 0.84, 0.7
        else:
            back = front - max(0.08, 0.4 * style.nose)
        top = [0, fin_x[0], fin_x[1], back, front, 1]
        side = [0, wing_x - style.chord, wing_x, max(back, wing_x + 0.02), front, 1]
        self.parts.insert(0, self.fuselage.part(top, side))

    def _wing(self) -> None:
        st, rng = self.style, self.rng
        semi = st.span / 2
        kink = None
        if st.kind in ("airliner", "quad", "trijet") or (
            st.kind == "regional" and chance(rng, 0.6)
        ):
            eta = rng.uniform(0.3, 0.4)
            inner = 1 - rng.uniform(0.8, 1.0) * np.tan(st.sweep) * eta * semi / st.chord
            kink = (eta, max(inner, 1.2 * st.taper))
        oval = 0.0
        if st.kind == "warbird" and chance(rng, 0.3):
            oval = rng.uniform(0.5, 0.9)
        strake = (0.0, 0.25)
        if st.kind == "twin-fin" and chance(rng, 0.6):
            strake = (rng.uniform(0.08, 0.2), rng.uniform(0.25, 0.45))
        thin = 0.7 if st.fuselage in ("tube", "sleek") else 0.85
        self.wing = af.Surface(
            semi, st.chord, st.taper, st.sweep, (st.thick, thin * st.thick),
            dihedral=st.dihedral, camber=rng.uniform(0, 0.025) if st.thick > 0.09 else 0.0,
            kink=kink, ellipse=oval, fillet=strake,
            tip=rng.uniform(0.01, 0.06), bend=rng.uniform(0, 0.03),
        )  # fmt: skip
        middle = 1 - st.edge - 0.4 * st.chord
        height, width, axis = self.fuselage.at(middle)
        self.wing_at = (1 - st.edge, axis + st.mount * height, 0.0)
        buried = width * np.sqrt(max(1 - abs(st.mount) ** 2.2, 0.02)) if abs(st.mount) < 1 else 0.02
        self.parts += af.both(self.wing.part("wing-right", buried).mapped(af.moved(*self.wing_at)))
        if st.fuselage in ("tube", "sleek") and chance(rng, 0.45):
            self._winglet()
        elif st.kind in ("attack", "interceptor", "bizjet") and chance(rng, 0.25):
            x, y, z = self._wing_point(1.0)
            length, radius = rng.uniform(0.2, 0.32), rng.uniform(0.016, 0.026)
            tank = blob(
                "tip-tank-right", 0, x - 0.65 * length, x + 0.35 * length, (radius, radius), (y, z),
                2.0, (0.45, 0.35),
            )  # fmt: skip
            self.parts += af.both(tank)

    def _wing_point(self, eta: float) -> tuple[float, float, float]:
        """The leading edge at a fraction of the half-span."""
        x, y, z, _ = self.wing.at(eta)
        return x + self.wing_at[0], y + self.wing_at[1], z

    def _winglet(self) -> None:
        rng = self.rng
        chord = self.wing.at(0.985)[3]
        x, y, z = self._wing_point(0.985)
        cant = rng.uniform(0.3, 1.45)
        blade = af.Surface(
            rng.uniform(0.035, 0.075), 0.92 * chord, rng.uniform(0.3, 0.7), rng.uniform(0.4, 0.8),
            (0.09, 0.08), tip=0.1,
        )  # fmt: skip
        self.parts += af.both(
            blade.part("winglet-right").mapped(rotation(0, -cant), af.moved(x - 0.03 * chord, y, z))
        )

    def _tail(self) -> tuple[float, float]:
        """Fin and tail plane; x of the fin root's trailing and leading edge."""
        st, rng = self.style, self.rng
        rear = rng.uniform(0.01, 0.05)
        tee, kind = st.tail_kind in ("tee", "mid"), st.tail_kind
        fin_taper = rng.uniform(0.6, 0.85) if kind == "tee" else rng.uniform(0.28, 0.6)
        lead = rear + st.fin_chord
        height, width, axis = self.fuselage.at(rear + 0.5 * st.fin_chord)
        fillet = (rng.uniform(0.05, 0.16), 0.4) if chance(rng, 0.35) else (0.0, 0.25)
        fin = af.Surface(
            st.fin_height, st.fin_chord, fin_taper, st.fin_sweep, (0.1, 0.09), fillet=fillet,
            tip=rng.uniform(0.02, 0.12), ellipse=0.4 * float(chance(rng, 0.2)),
        )  # fmt: skip
        if kind == "twin":
            cant = rng.uniform(0.0, 0.4)
            part = fin.part("fin-right", 0.5 * height)
            place = af.moved(lead, axis + 0.3 * height, rng.uniform(0.55, 0.85) * width)
            self.parts += af.both(part.mapped(af.upright(cant), place))
        elif kind not in ("vee", "ends"):
            part = fin.part("fin", height)
            self.parts.append(part.mapped(af.upright(), af.moved(lead, axis, 0)))
        self.fin_at = lead, axis
        if kind in ("none", "canard"):
            if kind == "canard":
                small = af.Surface(
                    rng.uniform(0.12, 0.18), rng.uniform(0.09, 0.14), 0.3, rng.uniform(0.6, 0.95),
                    (0.06, 0.05), dihedral=rng.uniform(-0.1, 0.15),
                )  # fmt: skip
                x = 1 - rng.uniform(0.22, 0.3)
                h, w, y = self.fuselage.at(x - 0.05)
                part = small.part("canard-right", w).mapped(af.moved(x, y + 0.3 * h, 0))
                self.parts += af.both(part)
            return rear, lead
        lean = {"vee": rng.uniform(0.5, 0.8)}.get(kind, rng.normal(0, 0.03) + 0.03)
        plane = af.Surface(
            st.tail_span / 2, st.tail_chord, rng.uniform(0.35, 0.75), st.tail_sweep, (0.1, 0.08),
            dihedral=0.0 if kind == "vee" else float(lean), tip=rng.uniform(0.02, 0.1),
        )  # fmt: skip
        x, y = rng.uniform(0.005, 0.03) + st.tail_chord, 0.0
        if tee:
            share = 0.97 if kind == "tee" else rng.uniform(0.4, 0.6)
            edge, _, up, chord = fin.at(share)
            x = lead + edge + rng.uniform(-0.1, 0.15) * chord
            y, width = axis + up, 0.01
        else:
            h, width, y = self.fuselage.at(x - 0.5 * st.tail_chord)
            y += rng.uniform(-0.2, 0.3) * h
        part = plane.part("tail-plane-right", width)
        if kind == "vee":
            part = part.mapped(rotation(0, -float(lean)))
        self.parts += af.both(part.mapped(af.moved(x, y, 0)))
        if kind == "ends":
            end = af.Surface(
                0.85 * st.fin_height, 0.85 * st.fin_chord, 0.6, 0.5 * st.fin_sweep, (0.09, 0.08),
                tip=0.2,
            )  # fmt: skip
            edge, up, z, chord = plane.at(0.97)
            low = rng.uniform(0.15, 0.4) * st.fin_height
            place = af.moved(x + edge + 0.15 * chord, y + up - low, z)
            self.parts += af.both(end.part("fin-right", low).mapped(af.upright(), place))
        return rear, lead

    def _engines(self) -> None:
        st, rng = self.style, self.rng
        kind, _, count = st.engines.partition("-")
        fourfold = count == "4"
        if kind == "pod":
            radius = rng.uniform(0.017, 0.025) if fourfold else rng.uniform(0.024, 0.036)
            stations = [("inner", rng.uniform(0.3, 0.38))]
            if fourfold:
                stations.append(("outer", rng.uniform(0.58, 0.68)))
            slim, gap = rng.uniform(3.2, 4.6), rng.uniform(0.1, 0.5)
            for place, eta in stations:
                self._pod(place, eta, radius, slim * radius, gap)
        elif kind == "prop":
            radius = rng.uniform(0.022, 0.03) if not fourfold else rng.uniform(0.018, 0.025)
            stations = [("inner", rng.uniform(0.26, 0.36) if not fourfold else 0.28)]
            if fourfold:
                stations.append(("outer", rng.uniform(0.5, 0.56)))
            turn, ahead = self._blades(), rng.uniform(0.06, 0.12)
            low = rng.uniform(-0.5, 0.3)
            for place, eta in stations:
                x, y, z = self._wing_point(eta)
                front = (x + ahead, y + low * radius, z)
                length = ahead + rng.uniform(0.5, 0.95) * self.wing.at(eta)[3]
                house = af.nacelle(f"engine-{place}-right", front, length, radius, rng, prop=True)
                self.parts += af.both(house)
                if turn:
                    reach = min(rng.uniform(0.05, 0.075), 0.95 * (z - self.style.radius))
                    hub = (front[0] - 0.01, front[1], z)
                    for blade in af.propeller(f"{place}-right", hub, reach, turn):
                        self.parts += af.both(blade)
        elif kind == "nose":
            _, _, axis = self.fuselage.at(0.995)
            radius = rng.uniform(0.012, 0.022)
            length = rng.uniform(0.03, 0.06)
            self.parts.append(
                blob("spinner", 0, 0.985, 0.99 + length, (radius, radius), (axis, 0), 2.0, (0, 0.8))
            )
            turn = self._blades()
            if turn:
                self.parts += af.propeller("nose", (1.005, axis, 0), rng.uniform(0.09, 0.14), turn)
        if kind == "rear":
            self._rear_pods()
        if count == "3":
            radius = rng.uniform(0.024, 0.032)
            x = rng.uniform(0.24, 0.3)
            height, _, axis = self.fuselage.at(x - 0.05)
            front = (x, axis + height + 0.6 * radius, 0.0)
            self.parts.append(af.nacelle("engine-centre", front, x - 0.02, radius, rng))
        if kind == "nozzles":
            height, width, axis = self.fuselage.at(0.05)
            radius = min(0.85 * height, 0.55 * width)
            nozzle = Part(
                "nozzle-right", 0, -rng.uniform(0.02, 0.05), 0.12,
                Superellipse(smooth([0, 1], [0.75 * radius, radius]), radius, 2.0),
                centre=(axis, 0.45 * width),
            )  # fmt: skip
            self.parts += af.both(nozzle)

    def _blades(self) -> tuple[int, float, float] | None:
        """Count, phase and half-width of propeller blades; None for a bare spinner."""
        if chance(self.rng, 0.35):
            return None
        count = int(self.rng.integers(2, 5))
        return count, self.rng.uniform(0, 2 * np.pi), self.rng.uniform(0.006, 0.011)

    def _pod(self, place: str, eta: float, radius: float, length: float, gap: float) -> None:
        x, y, z = self._wing_point(eta)
        chord = self.wing.at(eta)[3]
        drop = y - 0.3 * self.style.thick * chord - (1 + gap) * radius
        front = (x + self.rng.uniform(0.5, 0.8) * length, drop, z)
        self.parts += af.both(af.nacelle(f"engine-{place}-right", front, length, radius, self.rng))
        foot = (front[0] - 0.5 * length, drop, z)
        head = (min(x - 0.3 * chord, foot[0]), y, z)
        half = (0.33 * length, 0.22 * chord)
        self.parts += af.both(af.pylon(f"pylon-{place}-right", foot, head, 1, half))

    def _rear_pods(self) -> None:
        rng = self.rng
        radius = rng.uniform(0.02, 0.032)
        length = rng.uniform(3.6, 5.2) * radius
        x = rng.uniform(0.24, 0.34)
        height, width, axis = self.fuselage.at(x - 0.5 * length)
        y = axis + rng.uniform(0.2, 0.7) * height
        z = width + radius * rng.uniform(1.1, 1.7)
        self.parts += af.both(af.nacelle("engine-tail-right", (x, y, z), length, radius, rng))
        middle = x - 0.5 * length
        half = (0.4 * length, 0.3 * length)
        self.parts += af.both(
            af.pylon("pylon-tail-right", (middle, y, 0.0), (middle, y, z), 2, half)
        )

    def _canopy(self) -> None:
        st, rng = self.style, self.rng
        low, high = {
            "jet": (0.14, 0.4), "warbird": (0.3, 0.52), "pod": (0.07, 0.3),
        }.get(st.fuselage, (0.26, 0.46))  # fmt: skip
        odds = {"jet": 0.95, "warbird": 0.9, "pod": 0.5}.get(st.fuselage, 0.0)
        if st.kind == "low-wing":
            odds = 0.35
        if not chance(rng, odds):
            return
        front = 1 - low - rng.uniform(0, 0.05)
        back = 1 - high + rng.uniform(-0.04, 0.08)
        height, width, axis = self.fuselage.at(0.5 * (front + back))
        half = (rng.uniform(0.4, 0.65) * height, min(rng.uniform(0.45, 0.75) * width, 0.045))
        y = axis + rng.uniform(0.75, 0.9) * height
        ends = (rng.uniform(0.4, 0.6), rng.uniform(0.3, 0.4))
        self.parts.append(blob("canopy", 0, back, front, half, (y, 0.0), 2.0, ends))

    def _extras(self) -> None:
        st, rng = self.style, self.rng
        if st.fuselage in ("tube", "sleek") and st.mount < 0 and chance(rng, 0.6):
            middle = 1 - st.edge - 0.45 * st.chord
            height, width, axis = self.fuselage.at(middle)
            length = rng.uniform(0.6, 0.85) * st.chord
            half = (rng.uniform(0.45, 0.6) * height, rng.uniform(0.8, 1.1) * width)
            self.parts.append(
                blob(
                    "belly", 0, middle - length, middle + length, half, (axis - 0.65 * height, 0.0)
                )
            )
        if st.fuselage == "jet" and chance(rng, 0.55):
            front = rng.uniform(0.58, 0.72)
            height, width, axis = self.fuselage.at(front - 0.1)
            tall, wide = rng.uniform(0.4, 0.65) * height, rng.uniform(0.3, 0.5) * width
            y, z = axis + rng.uniform(-0.3, 0.2) * height, width
            length = rng.uniform(0.3, 0.5)
            hollow = dish(0, front - length, front, (y, z), 0.8 * min(tall, wide), 0.03)
            section = Superellipse(
                linear([0, 0.7, 1], [0.4 * tall, tall, tall]),
                linear([0, 0.7, 1], [0.15 * wide, wide, wide]),
                rng.uniform(2.5, 5),
            )
            self.parts += af.both(
                Part("intake-right", 0, front - length, front, section, (y, z), maps=(hollow,))
            )
        if st.kind == "high-wing" and chance(rng, 0.6):
            eta = rng.uniform(0.4, 0.55)
            x, y, z = self._wing_point(eta)
            foot_x = x - 0.35 * self.wing.at(eta)[3]
            height, width, axis = self.fuselage.at(foot_x)
            start = (foot_x + 0.01, axis - 0.75 * height, 0.8 * width)
            self.parts += af.both(bar("strut-right", 2, start, (foot_x, y, z), (0.012, 0.004), 2.0))

    def _gear(self) -> None:
        st, rng = self.style, self.rng
        light = st.fuselage == "cabin"
        if not chance(rng, 0.6 if light else 0.18) or st.fuselage == "pod":
            return
        size = rng.uniform(0.018, 0.027) if st.span > 1.1 else rng.uniform(0.012, 0.018)
        z, back = rng.uniform(0.05, 0.12), rng.uniform(0.35, 0.6)
        if st.mount < -0.2:  # legs below the wing
            z = max(z, 0.8 * self.fuselage.at(1 - st.edge)[1])
            eta = z / self.wing.reach
            edge, y, _ = self._wing_point(eta)
            x = edge - back * self.wing.at(eta)[3]
            height, _, axis = self.fuselage.at(x)
            top = x, y, z
        else:
            x = 1 - st.edge - back * st.chord
            height, width, axis = self.fuselage.at(x)
            z = max(z, 0.8 * width)
            top = x, axis - 0.6 * height, 0.5 * width
        foot = x, axis - height - rng.uniform(1.6, 3.0) * size, z
        half = 0.007, 0.01
        self.parts += af.both(bar("gear-leg-right", 1, foot, top, half, 2.0))
        self.parts += af.both(af.wheel("gear-wheel-right", foot, size, 0.4 * size))
        if st.kind == "warbird" or (light and chance(rng, 0.2)):
            return
        x = 1 - rng.uniform(0.1, 0.16)
        h, _, axis = self.fuselage.at(x)
        self.parts.append(
            bar("gear-leg-nose", 1, (x, foot[1], 0), (x, axis - 0.5 * h, 0), half, 2.0)
        )
        self.parts.append(af.wheel("gear-wheel-nose", (x, foot[1], 0), 0.85 * size, 0.35 * size))
