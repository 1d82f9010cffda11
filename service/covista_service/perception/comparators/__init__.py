"""What others have proposed to tell how much two images have in common, on the same features, cameras and poses.

None of these was made to measure a share of the image: they are here to be compared with.
"""
