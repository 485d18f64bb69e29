"""Scripts that reproduce the figures and claims of the thesis and measure the peers."""
