"""Sample sets: where to evaluate the integrand, and how the samples were drawn."""
