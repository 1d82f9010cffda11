"""Which robots belong together: similarity, spectral clustering, number of groups, labels over time.

Imports numpy, SciPy, OpenCV and numba, and nothing else.
"""
