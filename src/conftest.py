"""For doctests of one file: the package comes first, or its modules would take their functions' names."""

import voroquad  # noqa: F401
