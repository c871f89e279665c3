"""The explorer: sample sets, cells, weights and their errors, interactive in a browser."""
