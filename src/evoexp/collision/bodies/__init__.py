"""Bodies of robots as spheres, capsules and circles, and the kernels that test them."""
