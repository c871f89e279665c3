"""The talk's numerical study: test functions, convergence experiments, figures."""
