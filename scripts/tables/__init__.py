"""The tables of README and docs, made from the committed results of benchmarks."""
