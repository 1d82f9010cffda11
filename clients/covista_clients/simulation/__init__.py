"""A simulated swarm: textured worlds, what cameras see in them, how rovers drive, and what they send.

World frame: z up, metres. Camera frame: OpenCV's (x right, y down, z forward). NumPy and OpenCV only (extra `vision`).
"""
