"""One self-contained HTML page from the folders that studies and comparisons leave."""
