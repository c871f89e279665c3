"""Bokeh inside the page: its library, and models as the page's script embeds them."""

from __future__ import annotations

from typing import Any

from .._support.extras import install_hint

try:
    from bokeh.document import Document
    from bokeh.models import Model
    from bokeh.resources import Resources
except ImportError as error:
    raise ImportError(f"reports need Bokeh; {install_hint('study')}") from error


def library() -> str:
    """Bokeh's own JavaScript, as text that a script element can hold."""
    return "\n".join(Resources(mode="inline", components=["bokeh"]).js_raw).replace("</script", r"<\/script")


def embedded(models: dict[str, Model]) -> dict[str, Any]:
    """What the script needs to show models: their document, and which model goes into the element of which id."""
    document = Document()
    for model in models.values():
        document.add_root(model)
    return {
        "document": document.to_json(deferred=False),
        "roots": {model.id: element for element, model in models.items()},
    }
