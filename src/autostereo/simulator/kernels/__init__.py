"""The machine's inner loops, compiled by Numba; each steps through one stage of the pipeline."""
