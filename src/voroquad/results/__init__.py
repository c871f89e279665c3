"""Results on disk: the manifest that reports are made from, the house style of figures, errors at equal cost."""
