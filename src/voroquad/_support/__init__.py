"""Helpers for all sub-packages: checks of arguments, files, progress, BLAS threads, units of work."""
