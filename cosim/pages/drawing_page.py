"""Page of a part's drawings: one panel at a time, which turns with the pointer, and moves where a layer has a rest.

    write_page(Path("robot.html"), drawing_page(part.drawing()))

Drawings are known by their attributes alone (`components/_modelling/drawing.py`).
"""

from hfsa.cosim.figures.drawing import Drawing
from hfsa.cosim.pages.page import Page
from hfsa.cosim.pages.panel_data import LOOKS, panel_data

_BODY = """<div id="panels" role="tablist" aria-label="Panels"></div>
<div id="plot" role="img" aria-live="polite"></div>
<div id="controls">
<button id="play" type="button" aria-pressed="false">Play</button>
<label for="size">Displacement, times what is drawn <input id="size" type="range" min="0" max="3" step="0.05" value="1">
<output id="times" for="size">1</output></label>
</div>
<p class="hint">Drag turns the view, the wheel changes its size, a point under the pointer shows its coordinates. Keys:
left and right change the panel, the space bar plays.</p>
"""


def drawing_page(drawing: Drawing) -> Page:
    """Return the page of a drawing."""
    data = {
        "panels": [panel_data(panel, f"panel {place}") for place, panel in enumerate(drawing.panels, 1)],
        **LOOKS,
    }
    return Page(drawing.title, _BODY, ("panel.js", "drawing.js"), data)
