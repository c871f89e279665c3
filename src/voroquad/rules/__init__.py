"""Rules: how a sample set becomes weights, and how their bias is removed."""
