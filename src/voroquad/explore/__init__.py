"""The explorer: sample sets, cells, weights and their errors, to play with in a browser."""
