"""Integrals of functions: `quad`, measures, typed formulas and point files."""
