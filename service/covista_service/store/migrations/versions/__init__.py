"""The schemas that there were, each as a step from the one before."""
