"""JavaScript that finds Bokeh's models in a report's page."""

from __future__ import annotations

#: All roots; one of the plots of errors; the colours of the error images
ROOTS = "Bokeh.documents.flatMap((d) => d.roots())"
PLOT = f"{ROOTS}.find((r) => r.renderers.some((s) => s.name === 'line-0'))"
MAPPER = "Bokeh.documents.map((d) => d.get_model_by_name('mapper')).find((m) => m)"
