"""Pages for people, below `/dashboard`: who is with whom, and why. NiceGUI (extra `dashboard`) serves them.

The pages are shells. What they show their scripts ask for: REST, with the same answers as everybody, and a few routes
of our own for what only a page needs (`data`). Nothing is pushed, so a page that nobody reads costs nothing.
"""
