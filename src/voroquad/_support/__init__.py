"""What every room uses: checks of arguments, files, progress, BLAS threads, units of work."""
