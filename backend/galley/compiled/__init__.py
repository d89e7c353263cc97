"""One way to compile a kernel, one way to draw a random number."""
