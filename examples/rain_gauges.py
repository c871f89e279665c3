"""How much rain fell on a catchment? Gauges stand where people live, so that their mean is not the catchment's.

    pip install '.[geo,study]'
    python examples/rain_gauges.py -o out/rain

Each gauge stands for its Thiessen polygon, its Voronoi cell in the catchment. The rain is a formula here, so that a
fine grid knows the truth. `gauges.png` shows the polygons.
"""

import argparse
from pathlib import Path

import numpy as np
import shapely

import voroquad as vq


def catchment() -> shapely.Polygon:
    """A valley 30 km long with a lake, in kilometres."""
    river = shapely.LineString([(0, 0), (8, 3), (14, 2), (22, 8), (27, 9)])
    valley = river.buffer(5).union(shapely.LineString([(12, 3), (13, 11)]).buffer(3))
    return valley.difference(shapely.Point(21, 6.5).buffer(1.5))


def rain(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Millimetres in a day: more towards the head of the valley, and a shower."""
    return 8 + 0.9 * x + 25 * np.exp(-((x - 13) ** 2 + (y - 9) ** 2) / 12)


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("-o", "--output", type=Path)
output = parser.parse_args().output

area = catchment()
rng = np.random.default_rng(5)
anywhere = rng.uniform((-6, -6), (33, 15), (4000, 2))
inside = anywhere[shapely.contains_xy(area, *anywhere.T)]
lived_in = rng.random(len(inside)) < np.exp(-np.hypot(*(inside - [3, 1]).T) / 6)  # near the town at the mouth
gauges = np.concatenate([inside[lived_in][:25], inside[~lived_in][:12]])
measured = rain(*gauges.T)

cells = vq.cells(gauges, domain=area)
thiessen = cells.measures @ measured / area.area

grid = np.stack(np.meshgrid(np.arange(-6, 33, 0.05), np.arange(-6, 15, 0.05)), axis=-1).reshape(-1, 2)
truth = rain(*grid[shapely.contains_xy(area, *grid.T)].T).mean()
print(f"mean of the gauges  {measured.mean():.2f} mm")
print(f"Thiessen polygons   {thiessen:.2f} mm")
print(f"fine grid           {truth:.2f} mm")

if output:
    output.mkdir(parents=True, exist_ok=True)
    ax = cells.plot(measured, cmap="YlGnBu")
    ax.set(title="Thiessen polygons, coloured by the rain at their gauges", xlabel="km", ylabel="km")
    ax.figure.set_size_inches(9, 4.6)
    ax.figure.colorbar(ax.collections[0], label="mm", shrink=0.8)
    ax.figure.savefig(output / "gauges.png", dpi=150, bbox_inches="tight")
