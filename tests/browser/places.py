"""The pages that there are: address and heading."""

PLACES = {
    "/dashboard/": "Swarm",
    "/dashboard/similarity": "Similarity",
    "/dashboard/timeline": "Timeline",
    "/dashboard/what-if": "What if",
    "/dashboard/health": "Health",
}
# Those too that one comes to from others.
PAGES = PLACES | {"/dashboard/pairs/r1/r2": "Pair", "/dashboard/robots/r1": "Robot"}
