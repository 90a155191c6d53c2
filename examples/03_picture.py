"""Draw clouds with their regions: writes chairs.png into the current folder.

python examples/03_picture.py
"""

from nrdf.bundled import REFERENCE, TARGETS, bundled_chair
from nrdf.viz.picture import Panel, draw_regions

panels = []
for name in (REFERENCE, *TARGETS):
    cloud, regions = bundled_chair(name)  # cloud.points (8192, 3), name -> mask (8192,)
    panels.append(Panel(name, cloud.points, regions=regions, note=f"{len(cloud)} points"))
draw_regions(panels, "chairs.png")
