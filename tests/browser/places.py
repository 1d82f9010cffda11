"""The pages that there are: address and heading, title, and what stands on them when the station has answered."""

PLACES = {
    "/dashboard/": "Swarm",
    "/dashboard/similarity": "Similarity",
    "/dashboard/timeline": "Timeline",
    "/dashboard/what-if": "What if",
    "/dashboard/health": "Health",
}
# Those too that one comes to from others.
PAGES = PLACES | {"/dashboard/pairs/r1/r2": "Pair", "/dashboard/robots/r1": "Robot"}
# Where it is not the heading.
TITLES = {"Pair": "r1 and r2", "Robot": "r1"}
# By heading, of a station with robots.
CONTENT = {
    "Swarm": ("section[aria-labelledby=cv-groups] li", "canvas[data-revision]"),
    "Similarity": (".cv-similarity canvas", "section[aria-labelledby=cv-number] details"),
    "Timeline": (".cv-timeline canvas", ".cv-then-groups li"),
    "What if": ("section[aria-labelledby=cv-beside] li", "section[aria-labelledby=cv-scores] details"),
    "Health": ("section[aria-labelledby=cv-parts] tbody tr", "section[aria-labelledby=cv-facts] dd"),
    "Pair": (".cv-picture img", "section[aria-labelledby=cv-facts] dd"),
    "Robot": ("#cv-robot-id", ".cv-view", "section[aria-labelledby=cv-neighbours] td"),
}
