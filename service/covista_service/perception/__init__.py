"""What two cameras see in common: functions of arrays, without I/O, logging or clock.

Imports numpy, SciPy, OpenCV and numba, and nothing else.
"""
